# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Frozen records that travel from stage to stage.

All lengths are metres; depth is REP-118 (float32 metres along the optical axis, NaN = no
reading). `T_a_b` is a 4x4 float64 matrix that maps points of frame b into frame a. The
world frame has z up and the table top at z = 0; camera frames are optical (x right, y down,
z forward). Pixel centres have integer coordinates.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from hooc_perception.core.arrays import (
    AnyArray,
    BoolArray,
    Float32Array,
    Float64Array,
    Int32Array,
    UInt8Array,
    UInt16Array,
)
import numpy as np
from scipy.spatial.transform import Rotation


@dataclass(frozen=True)
class Camera:
    """
    A calibrated depth camera.

    :ivar K: (3, 3) float64 intrinsics, pixels.
    :ivar D: distortion coefficients as in CameraInfo, (5,) plumb_bob or (8,)
        rational_polynomial; all zero once rectified.
    :ivar T_world_camera: (4, 4) float64, camera to world.
    """

    name: str
    width: int
    height: int
    K: Float64Array
    D: Float64Array
    T_world_camera: Float64Array
    distortion_model: str = 'plumb_bob'


@dataclass(frozen=True)
class DepthView:
    """
    One raw depth image, still distorted.

    :ivar depth: (H, W) float32 metres, NaN = none.
    :ivar hidden: (H, W) bool, pixels where the robot hides the scene, whose readings do not
        count; None = nowhere.
    """

    camera: Camera
    depth: Float32Array
    hidden: BoolArray | None = None


@dataclass(frozen=True)
class RectifiedView:
    """
    One undistorted depth image; camera.D = 0.

    :ivar depth: (H, W) float32 metres, NaN = none.
    :ivar hidden: (H, W) bool, pixels where the robot hides the scene; `depth` is NaN there. None
        = nowhere.
    """

    camera: Camera
    depth: Float32Array
    hidden: BoolArray | None = None


@dataclass(frozen=True)
class ObservedView:
    """
    A rectified view set against the empty table.

    :ivar camera: its pose corrected so that the table lies at z = 0 in this view.
    :ivar depth: (H, W) float32 measured, NaN = none.
    :ivar background: (H, W) float32 depth of the empty scene, NaN where unknown.
    :ivar foreground: (H, W) bool, measured points on or above the table's surface that do
        not belong to it.
    :ivar table: (H, W) bool, pixels whose ray meets the table inside its borders.
    :ivar hidden: (H, W) bool, pixels where the robot hides the scene, so that nothing was
        measured of it; None = nowhere.
    """

    camera: Camera
    depth: Float32Array
    background: Float32Array
    foreground: BoolArray
    table: BoolArray
    hidden: BoolArray | None = None


@dataclass(frozen=True)
class Observation:
    """
    A frame set as the later stages see it.

    :ivar views: one ObservedView a camera, in camera order.
    :ivar noise_m: standard deviation of the measured heights of the table top.
    :ivar T_target_table: (4, 4) float64 from the table frame, in which the views are posed and
        the stages work, to the target frame of results; None = the same frame.
    :ivar troubles: one sentence per camera that does not see the table where it should be.
    """

    views: tuple[ObservedView, ...]
    noise_m: float
    T_target_table: Float64Array | None = None
    troubles: tuple[str, ...] = ()

    def in_target_frame(self) -> 'Observation':
        """Return the same with its views posed in the target frame."""
        if self.T_target_table is None:
            return self
        return Observation(tuple(
            replace(view, camera=replace(view.camera, T_world_camera=self.T_target_table
                                         @ view.camera.T_world_camera))
            for view in self.views), self.noise_m, troubles=self.troubles)


@dataclass(frozen=True)
class PixelProbabilities:
    """
    Class probabilities of the foreground pixels of every view.

    :ivar camera: (M,) uint8 index of the view.
    :ivar uv: (M, 2) uint16 pixel column and row.
    :ivar p: (M, N + 1) uint8, probability x 255; column 0 is background, column c is class c.
        Pixels that are not listed are background with certainty.
    """

    camera: UInt8Array
    uv: UInt16Array
    p: UInt8Array


@dataclass(frozen=True)
class Candidates:
    """
    Hypotheses, row by row: which category, where, how large.

    :ivar category: (n,) uint16 class ids 1..N.
    :ivar translation: (n, 3) float64 centre of the bounding box, world, metres.
    :ivar rotation_xyzw: (n, 4) float64 unit quaternion, model axes to world.
    :ivar size: (n, 3) float32 extents along the model axes, metres.
    :ivar score: (n,) float32, the larger the better; comparable within a category.
    :ivar member: (n,) uint16, which mesh of the category's family, see GenericModel.members;
        default 0 everywhere, the generic mesh itself.
    """

    category: UInt16Array
    translation: Float64Array
    rotation_xyzw: Float64Array
    size: Float32Array
    score: Float32Array
    member: UInt16Array = field(default_factory=lambda: np.zeros(0, np.uint16))

    def __post_init__(self) -> None:
        """Let every row be the generic mesh where nothing else was said."""
        if not len(self.member) and len(self.category):
            object.__setattr__(self, 'member', np.zeros(len(self.category), np.uint16))

    def __len__(self) -> int:
        """Return the number of candidates."""
        return len(self.category)

    @staticmethod
    def empty() -> 'Candidates':
        """Return a set without members."""
        return Candidates(np.zeros(0, np.uint16), np.zeros((0, 3)), np.zeros((0, 4)),
                          np.zeros((0, 3), np.float32), np.zeros(0, np.float32))

    def moved(self, T_to_from: Float64Array | None) -> 'Candidates':
        """Return the same in another frame, by a rigid (4, 4); None = the same frame."""
        if T_to_from is None or not len(self):
            return self
        turn = Rotation.from_matrix(T_to_from[:3, :3])
        return replace(self, translation=self.translation @ T_to_from[:3, :3].T
                       + T_to_from[:3, 3],
                       rotation_xyzw=(turn * Rotation.from_quat(self.rotation_xyzw)).as_quat())

    def take(self, index: 'AnyArray | list[int]') -> 'Candidates':
        """Return the rows that `index` (integers or bool mask) names."""
        return Candidates(self.category[index], self.translation[index],
                          self.rotation_xyzw[index], self.size[index], self.score[index],
                          self.member[index])

    def extended(self, other: 'Candidates') -> 'Candidates':
        """Return these rows followed by the rows of `other`."""
        return Candidates(*(np.concatenate([getattr(self, name), getattr(other, name)])
                            for name in ('category', 'translation', 'rotation_xyzw', 'size',
                                         'score', 'member')))

    def shapes(self, models: Sequence['GenericModel']) -> 'list[GenericModel]':
        """Return the mesh of each row; class id c is models[c - 1]."""
        return [models[c - 1].members[m] for c, m in zip(self.category.tolist(),
                                                         self.member.tolist())]


@dataclass(frozen=True)
class GenericModel:
    """
    One category's generic mesh, cleaned and centred, with everything derived from it.

    :ivar vertices: (V, 3) float64 metres, bounding-box centre at the origin.
    :ivar faces: (F, 3) int32.
    :ivar extents: (3,) float64 sides of the bounding box, metres.
    :ivar surface_points: (P, 3) float32, uniform on the surface.
    :ivar surface_normals: (P, 3) float32, outward where the mesh has an inside.
    :ivar interior_points: (Q, 3) float32, uniform in the (repaired) volume.
    :ivar volume: volume of the repaired mesh, m^3.
    :ivar rest_rotations: (R, 4) float64 xyzw, model to world at each stable resting pose,
        most probable first; row 0.. are complete only up to yaw.
    :ivar rest_probability: (R,) float64, sums to at most 1.
    :ivar symmetry: axis order around each model axis, (3,) int32: 1 none, 2, 3, 4, ... and
        0 for a continuous (revolution) symmetry.
    :ivar variants: further meshes of the category, in the same axes.
    """

    name: str
    vertices: Float64Array
    faces: Int32Array
    extents: Float64Array
    surface_points: Float32Array
    surface_normals: Float32Array
    interior_points: Float32Array
    volume: float
    rest_rotations: Float64Array
    rest_probability: Float64Array
    symmetry: Int32Array
    variants: 'tuple[GenericModel, ...]' = ()

    @property
    def members(self) -> 'tuple[GenericModel, ...]':
        """Return all meshes of the category's family, this one first."""
        return (self, *self.variants)

    @property
    def longest_side(self) -> float:
        """Return the longest side of the bounding box, metres: its size in the paper."""
        return float(np.max(self.extents))


@dataclass(frozen=True)
class UnknownObjects:
    """
    Things of no category, row by row: upright boxes.

    :ivar translation: (n, 3) float64 centre of the box, metres.
    :ivar rotation_xyzw: (n, 4) float64, box axes to world.
    :ivar size: (n, 3) float32 sides of the box along its axes, metres.
    :ivar score: (n,) float32, how sure the classifier is of something else, 0 to 1; NaN where it
        was not trained among things of no category.
    :ivar hulls: one (k, 3) float64 each, corners of the convex hull of what was seen, metres.
    """

    translation: Float64Array
    rotation_xyzw: Float64Array
    size: Float32Array
    score: Float32Array
    hulls: tuple[Float64Array, ...]

    def __len__(self) -> int:
        """Return the number of things."""
        return len(self.translation)

    @staticmethod
    def empty() -> 'UnknownObjects':
        """Return a set without members."""
        return UnknownObjects(np.zeros((0, 3)), np.zeros((0, 4)), np.zeros((0, 3), np.float32),
                              np.zeros(0, np.float32), ())

    def take(self, index: 'AnyArray | list[int]') -> 'UnknownObjects':
        """Return the rows that `index` (integers or bool mask) names."""
        rows = np.arange(len(self))[index]
        return UnknownObjects(self.translation[rows], self.rotation_xyzw[rows], self.size[rows],
                              self.score[rows], tuple(self.hulls[k] for k in rows))

    def moved(self, T_to_from: Float64Array | None) -> 'UnknownObjects':
        """Return the same in another frame, by a rigid (4, 4); None = the same frame."""
        if T_to_from is None or not len(self):
            return self
        R, t = T_to_from[:3, :3], T_to_from[:3, 3]
        turn = Rotation.from_matrix(R) * Rotation.from_quat(self.rotation_xyzw)
        return replace(self, translation=self.translation @ R.T + t, rotation_xyzw=turn.as_quat(),
                       hulls=tuple(hull @ R.T + t for hull in self.hulls))


@dataclass(frozen=True)
class Energy:
    """The three terms of Eq. 1 and their sum (Basevi & Leonardis 2016)."""

    depth: float
    probability: float
    overlap: float

    @property
    def total(self) -> float:
        """Return the sum of the terms."""
        return self.depth + self.probability + self.overlap


@dataclass(frozen=True)
class ParsedScene:
    """
    The result of one frame set, with its evidence.

    :ivar objects: the chosen candidates, refined; `score` in [0, 1], see parsing/answer.py and
        parsing/calibration.py.
    :ivar energy: Eq. 1 of the chosen subset (for every profile, so that they compare).
    :ivar visible_ratio: (n,) float32 share of each object's rendered pixels that are in sight.
    :ivar residual_m: (n,) float32 mean absolute depth residual over the pixels where it agrees.
    :ivar energy_delta: (n,) float32 rise of the search's own energy if the object is removed.
    :ivar n_views: (n,) uint8 number of views that show it.
    :ivar pool: every candidate that was considered.
    :ivar sigma_t, sigma_r: (n,) float32, metres and radians within which 68 % of the errors lie,
        see core.parsing.uncertainty; NaN where that is not known, None where nobody asked.
    :ivar unknown: things of no category, see core.parsing.unknown.
    :ivar runners_up: the candidates that were in the running at last and were not chosen.
    :ivar converged: False where a deadline ended the search.
    :ivar seconds: wall time of each stage.
    :ivar hidden_s: (n,) float32, seconds since an object that the robot hides was last seen; 0 for
        objects that were found. None = all were found.
    """

    objects: Candidates
    energy: Energy
    visible_ratio: Float32Array
    residual_m: Float32Array
    energy_delta: Float32Array
    n_views: UInt8Array
    pool: Candidates
    converged: bool = True
    seconds: dict[str, float] = field(default_factory=dict)
    sigma_t: Float32Array | None = None
    sigma_r: Float32Array | None = None
    unknown: UnknownObjects = field(default_factory=UnknownObjects.empty)
    hidden_s: Float32Array | None = None
    runners_up: Candidates = field(default_factory=Candidates.empty)

    def take(self, index: 'AnyArray') -> 'ParsedScene':
        """Return the scene with those objects that a bool mask names; its energy stays."""
        sigma_t, sigma_r, hidden_s = (None if values is None else values[index] for values in (
            self.sigma_t, self.sigma_r, self.hidden_s))
        return replace(
            self, objects=self.objects.take(index), visible_ratio=self.visible_ratio[index],
            residual_m=self.residual_m[index], energy_delta=self.energy_delta[index],
            n_views=self.n_views[index], sigma_t=sigma_t, sigma_r=sigma_r, hidden_s=hidden_s)

    def moved(self, T_to_from: Float64Array | None) -> 'ParsedScene':
        """Return the same in another frame, by a rigid (4, 4); None = the same frame."""
        return replace(self, objects=self.objects.moved(T_to_from),
                       pool=self.pool.moved(T_to_from), unknown=self.unknown.moved(T_to_from),
                       runners_up=self.runners_up.moved(T_to_from))

    def timed(self, **seconds: float) -> 'ParsedScene':
        """Return a copy whose `seconds` also hold the given stages."""
        return replace(self, seconds={**self.seconds, **seconds})

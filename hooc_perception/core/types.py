# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Frozen records that travel from stage to stage.

All lengths are metres; depth is REP-118 (float32 metres along the optical axis, NaN = no
reading). `T_a_b` is a 4x4 float64 matrix that maps points of frame b into frame a. The
world frame has z up and the table top at z = 0; camera frames are optical (x right, y down,
z forward). Pixel centres have integer coordinates.
"""

from dataclasses import dataclass, field, replace

from hooc_perception.core.geometry import matrix_from_pose
import numpy as np


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
    K: np.ndarray
    D: np.ndarray
    T_world_camera: np.ndarray
    distortion_model: str = 'plumb_bob'


@dataclass(frozen=True)
class DepthView:
    """One raw depth image: `depth` (H, W) float32 metres, NaN = none, still distorted."""

    camera: Camera
    depth: np.ndarray


@dataclass(frozen=True)
class RectifiedView:
    """One undistorted depth image: `depth` (H, W) float32 metres, NaN = none; camera.D = 0."""

    camera: Camera
    depth: np.ndarray


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
    """

    camera: Camera
    depth: np.ndarray
    background: np.ndarray
    foreground: np.ndarray
    table: np.ndarray


@dataclass(frozen=True)
class Observation:
    """
    A frame set as the later stages see it.

    :ivar views: one ObservedView a camera, in camera order.
    :ivar noise_m: standard deviation of the measured heights of the table top.
    """

    views: tuple
    noise_m: float


@dataclass(frozen=True)
class PixelProbabilities:
    """
    Class probabilities of the foreground pixels of every view.

    :ivar camera: (M,) uint8 index of the view.
    :ivar uv: (M, 2) uint16 pixel column and row.
    :ivar p: (M, N + 1) uint8, probability x 255; column 0 is background, column c is class c.
        Pixels that are not listed are background with certainty.
    """

    camera: np.ndarray
    uv: np.ndarray
    p: np.ndarray


@dataclass(frozen=True)
class Candidates:
    """
    Hypotheses, row by row: which category, where, how large.

    :ivar category: (n,) uint16 class ids 1..N.
    :ivar translation: (n, 3) float64 centre of the bounding box, world, metres.
    :ivar rotation_xyzw: (n, 4) float64 unit quaternion, model axes to world.
    :ivar size: (n, 3) float32 extents along the model axes, metres.
    :ivar score: (n,) float32, the larger the better; comparable within a category.
    """

    category: np.ndarray
    translation: np.ndarray
    rotation_xyzw: np.ndarray
    size: np.ndarray
    score: np.ndarray

    def __len__(self):
        """Return the number of candidates."""
        return len(self.category)

    @staticmethod
    def empty():
        """Return a set without members."""
        return Candidates(np.zeros(0, np.uint16), np.zeros((0, 3)), np.zeros((0, 4)),
                          np.zeros((0, 3), np.float32), np.zeros(0, np.float32))

    def take(self, index):
        """Return the rows that `index` (integers or bool mask) names."""
        return Candidates(self.category[index], self.translation[index],
                          self.rotation_xyzw[index], self.size[index], self.score[index])

    def extended(self, other):
        """Return these rows followed by the rows of `other`."""
        return Candidates(*(np.concatenate([getattr(self, name), getattr(other, name)])
                            for name in ('category', 'translation', 'rotation_xyzw', 'size',
                                         'score')))

    def T_world_model(self, i):
        """Return the (4, 4) rigid transform of row i; scale by `size / model.extents` first."""
        return matrix_from_pose(self.translation[i], self.rotation_xyzw[i])


@dataclass(frozen=True)
class GenericModel:
    """
    One category's generic mesh, cleaned and centred, and what is derived from it once.

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
    """

    name: str
    vertices: np.ndarray
    faces: np.ndarray
    extents: np.ndarray
    surface_points: np.ndarray
    surface_normals: np.ndarray
    interior_points: np.ndarray
    volume: float
    rest_rotations: np.ndarray
    rest_probability: np.ndarray
    symmetry: np.ndarray

    @property
    def longest_side(self):
        """Return the longest side of the bounding box, metres: its size in the paper."""
        return float(np.max(self.extents))


@dataclass(frozen=True)
class Energy:
    """The three terms of Eq. 1 and their sum (Basevi & Leonardis 2016)."""

    depth: float
    probability: float
    overlap: float

    @property
    def total(self):
        """Return the sum of the terms."""
        return self.depth + self.probability + self.overlap


@dataclass(frozen=True)
class ParsedScene:
    """
    The answer for one frame set, with its evidence.

    :ivar objects: the chosen candidates, refined; `score` in [0, 1], see core.parsing.calibration.
    :ivar energy: Eq. 1 of the chosen subset (for every profile, so that they compare).
    :ivar visible_ratio: (n,) float32 share of each object's rendered pixels that are in sight.
    :ivar residual_m: (n,) float32 mean absolute depth residual over the pixels where it agrees.
    :ivar energy_delta: (n,) float32 rise of the search's own energy if the object is removed.
    :ivar n_views: (n,) uint8 number of views that show it.
    :ivar pool: every candidate that was considered.
    :ivar sigma_t, sigma_r: (n,) float32, metres and radians within which 68 % of the errors lie,
        see core.parsing.uncertainty; NaN where that is not known, None where nobody asked.
    :ivar converged: False where a deadline ended the search.
    :ivar seconds: wall time of each stage.
    """

    objects: Candidates
    energy: Energy
    visible_ratio: np.ndarray
    residual_m: np.ndarray
    energy_delta: np.ndarray
    n_views: np.ndarray
    pool: Candidates
    converged: bool = True
    seconds: dict = field(default_factory=dict)
    sigma_t: np.ndarray | None = None
    sigma_r: np.ndarray | None = None

    def timed(self, **seconds):
        """Return a copy whose `seconds` also hold the given stages."""
        return replace(self, seconds={**self.seconds, **seconds})

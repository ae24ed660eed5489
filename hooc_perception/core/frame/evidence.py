# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The stacked pixels of all views, and hypotheses rendered and compared with them."""

from collections.abc import Sequence

from hooc_perception.core.arrays import (
    AnyArray,
    BoolArray,
    Float32Array,
    Float64Array,
    Int32Array,
    Int64Array,
)
from hooc_perception.core.frame.field import Cloud
from hooc_perception.core.frame.kernels import compare as kernel
from hooc_perception.core.frame.kernels import pixel_lists
from hooc_perception.core.frame.kernels.pixel_lists import PixelLists
from hooc_perception.core.frame.kernels.records import (
    Context,
    Hypotheses,
    Meshes,
    PixelOutput,
    PixelWeights,
    RefineSettings,
    Views,
)
from hooc_perception.core.frame.kernels.refine import refine_all
from hooc_perception.core.frame.pixel_index import first_pixels, rows_of_pixels, stacked_index
from hooc_perception.core.geometry import inverse
from hooc_perception.core.render import is_closed
from hooc_perception.core.shapes import Shapes
from hooc_perception.core.types import (
    Candidates,
    GenericModel,
    Observation,
    ObservedView,
    PixelProbabilities,
)
import numpy as np

# Cost above which a pixel counts as unexplained.
UNEXPLAINED = 0.6


class Evidence:
    """
    The views of one frame set, laid out for the kernels.

    :ivar views: Views, the stacked pixels; `shapes` the meshes, `meshes` the
        same for the kernels.
    :ivar scale: pixels here per pixel of the full images: costs shrink with them.
    :ivar row: (P,) int32 row of the cloud that each pixel fell into, -1 = none.
    :ivar cost_none: (P,) float32 cost of showing nothing; `nothing` the Context without members.
    """

    def __init__(self, observation: Observation, probabilities: PixelProbabilities,
                 shapes: Shapes, cloud: Cloud, patch: Int32Array, stride: int = 1,
                 unknown_weight: float = 0.0) -> None:
        """
        Stack every `stride`-th row and column of all views.

        :param shapes: the meshes that hypotheses name.
        :param cloud: Cloud of the observation; `patch` (n,) labels of its points.
        :param unknown_weight: PixelCosts.unknown_weight.
        """
        self.stride, self.scale = stride, 1.0 / (stride * stride)
        self.row = _stacked(cloud.row, stride)
        self.n_points = len(patch)
        self.views = _views_of(observation, probabilities, cloud, _labels(patch, self.row), stride)
        self.shapes, self.meshes = shapes, _meshes_of(shapes.models)
        self.cost_none: Float32Array = _cost_of_nothing(self.views, unknown_weight)
        n = len(self.cost_none)
        far = np.full(n, np.inf, np.float32)
        self.nothing = Context(np.full(n, -2, np.int32), far, self.cost_none, far, self.cost_none)

    def compare(self, hypotheses: Float64Array, shape: AnyArray, weights: PixelWeights,
                context: Context | None = None, me: AnyArray | Sequence[int] | None = None,
                ) -> Float64Array:
        """
        Render hypotheses and compare them with all views, each by itself.

        :param hypotheses: (m, 10+) float64, see core/kernels/pose.py.
        :param shape: (m,) numbers of their meshes in `shapes`.
        :param context: what is shown already, from `compose`; None = nothing.
        :param me: (m,) the number of each in `context`, which is looked through; -1 = none.
        :return: stats (m, STATS) float64; frame/kernels/compare.py names the columns.
        """
        subjects = self._subjects(hypotheses, shape, me)
        nowhere = PixelOutput(np.full(len(subjects.rows), -1), *_pixel_arrays(0))
        return kernel.compare_all(subjects, self.views, self.meshes, context or self.nothing,
                                  _as_floats(weights), nowhere)[0]

    def compare_pixels(self, hypotheses: Float64Array, shape: AnyArray, weights: PixelWeights,
                       context: Context | None = None,
                       me: AnyArray | Sequence[int] | None = None,
                       ) -> tuple[Float64Array, PixelLists]:
        """Return the stats of `compare`, and the pixels that each hypothesis covers."""
        subjects = self._subjects(hypotheses, shape, me)
        # Room for all pixels of their windows; what is never written to takes no memory.
        room = pixel_lists.window_areas(subjects, self.meshes, self.views)
        output = PixelOutput(np.cumsum(room) - room, *_pixel_arrays(room.sum()))
        stats, n = kernel.compare_all(subjects, self.views, self.meshes, context or self.nothing,
                                      _as_floats(weights), output)
        return stats, pixel_lists.packed(output.start, n, output.pixel, output.depth, output.cost)

    def _subjects(self, rows: Float64Array, shape: AnyArray,
                  me: AnyArray | Sequence[int] | None) -> Hypotheses:
        """Return Hypotheses as the kernels take them."""
        shape = np.ascontiguousarray(shape, np.int64)
        return Hypotheses(np.ascontiguousarray(rows[:, :10], np.float64), shape,
                          self.shapes.category[shape],
                          np.full(len(rows), -1) if me is None else np.asarray(me, np.int64))

    def compose(self, members: AnyArray | Sequence[int], lists: PixelLists) -> Context:
        """Return the Context that the given rows of PixelLists make; nearest wins."""
        none = self.nothing
        context = Context(none.owner.copy(), none.depth.copy(), none.cost.copy(),
                          none.next_depth.copy(), none.next_cost.copy())
        pixel_lists.compose(np.asarray(members, np.int64), lists, context)
        return context

    def unexplained(self, context: Context | None = None) -> Float64Array:
        """Return (n,) float64, the share of each cloud point's pixels that nothing explains."""
        return self._share_of_points((context or self.nothing).cost > UNEXPLAINED)

    def share_of_points(self, region: Sequence[BoolArray]) -> Float64Array:
        """
        Return (n,) float64, the share of each cloud point's pixels that lie in a region.

        :param region: per view (H, W) bool.
        """
        return self._share_of_points(_stacked(region, self.stride))

    def _share_of_points(self, pixels: BoolArray) -> Float64Array:
        """Return (n,) float64, the share of each cloud point's pixels that are True in (P,)."""
        seen = self.row >= 0
        total = np.bincount(self.row[seen], minlength=self.n_points)
        chosen = np.bincount(self.row[seen], weights=pixels[seen], minlength=self.n_points)
        return chosen / np.maximum(total, 1)

    def share_of_lists(self, lists: PixelLists, region: Sequence[BoolArray]) -> Float64Array:
        """Return (m,) float64, the share of each list's pixels in a region, see above."""
        inside = np.concatenate([[0], np.cumsum(_stacked(region, self.stride)[lists.pixel])])
        return np.diff(inside[lists.offsets]) / np.maximum(np.diff(lists.offsets), 1)

    def refine(self, hypotheses: Float64Array, shape: AnyArray, weights: PixelWeights,
               settings: RefineSettings, rng: np.random.Generator,
               context: Context | None = None, me: AnyArray | Sequence[int] | None = None,
               ) -> Float64Array:
        """
        Return a refined copy of hypotheses (m, 10), each by itself in its context.

        :param rng: draws one seed per hypothesis.
        :param me: (m,) the numbers of those that they replace in `context`, -1 for none.
        """
        # numba compiles a function anew for every combination of types.
        settings = RefineSettings(float(settings.complexity), float(settings.size_prior),
                                  int(settings.steps), *map(float, settings[3:]))
        subjects = self._subjects(hypotheses, shape, me)
        subjects = subjects._replace(rows=subjects.rows.copy())
        seeds = rng.integers(0, 2**31, len(subjects.rows))
        # Nobody asks for SHARE here.
        views = self.views._replace(patch_size=np.zeros(0, np.int64))
        refine_all(seeds, subjects, views, self.meshes, context or self.nothing,
                          _as_floats(weights), settings)
        return subjects.rows


def hypotheses_of(candidates: Candidates, shapes: Shapes) -> Float64Array:
    """Return (n, 10) float64 hypotheses of Candidates: translation, xyzw, scale per axis."""
    extents = shapes.extents[shapes.of(candidates)]
    return np.column_stack([candidates.translation, candidates.rotation_xyzw,
                            candidates.size / np.maximum(extents, 1e-9)]).astype(np.float64)


def _stacked(images: Sequence[AnyArray], stride: int) -> AnyArray:
    """Return (P, ...), every `stride`-th row and column of images (H, W, ...), stacked."""
    return np.concatenate([x[::stride, ::stride].reshape(-1, *x.shape[2:]) for x in images])


def _cost_of_nothing(views: Views, unknown_weight: float) -> Float32Array:
    """Return (P,) float32: what it costs to show no object, less where something else is."""
    something_else = np.zeros(len(views.foreground), np.float32)
    known = views.p_row >= 0
    something_else[known] = views.p[views.p_row[known], 0] / np.float32(255)
    return views.foreground * (1 - np.float32(unknown_weight) * something_else)


def _labels(patch: Int32Array, row: AnyArray) -> AnyArray:
    """Return (P,) int32, the smooth patch of each pixel, -1 = none."""
    return np.where(row >= 0, patch[row] if len(patch) else -1, -1).astype(np.int32)


def _views_of(observation: Observation, probabilities: PixelProbabilities, cloud: Cloud,
              patch: AnyArray, stride: int) -> Views:
    """Return the Views of an observation."""
    views: Sequence[ObservedView] = observation.views
    size = np.array([v.depth[::stride, ::stride].shape[::-1] for v in views], np.int64)
    K = np.stack([np.asarray(v.camera.K, np.float64) for v in views])
    K[:, :2] /= stride
    T_camera_world = [inverse(v.camera.T_world_camera) for v in views]
    first = first_pixels(views)
    p_row = rows_of_pixels(stacked_index(views, probabilities.camera, probabilities.uv),
                           int(first[-1]))
    p_rows = [p_row[a:b].reshape(v.depth.shape) for a, b, v in zip(first, first[1:], views)]
    return Views(
        K=K,
        R=np.ascontiguousarray(np.stack([T[:3, :3] for T in T_camera_world])),
        t=np.ascontiguousarray(np.stack([T[:3, 3] for T in T_camera_world])),
        size=size,
        first=np.concatenate([[0], np.cumsum(size.prod(1))]).astype(np.int64),
        depth=_stacked([v.depth for v in views], stride),
        foreground=_stacked([v.foreground for v in views], stride),
        normals=_stacked(cloud.view_normals, stride),
        patch=patch,
        patch_size=np.maximum(np.bincount(patch[patch >= 0], minlength=1), 1),
        p=np.ascontiguousarray(probabilities.p),
        p_row=_stacked(p_rows, stride))


def _meshes_of(models: Sequence[GenericModel]) -> Meshes:
    """Return the Meshes of GenericModels, without their variants."""
    return Meshes(
        vertices=np.concatenate([m.vertices for m in models]),
        vertex_start=np.cumsum([0] + [len(m.vertices) for m in models]),
        faces=np.concatenate([m.faces for m in models]).astype(np.int32),
        face_start=np.cumsum([0] + [len(m.faces) for m in models]),
        closed=np.array([is_closed(m) for m in models]))


def _pixel_arrays(n: int) -> tuple[Int64Array, Float32Array, Float32Array]:
    """Return uninitialized arrays for the pixel, depth and cost of n entries."""
    return np.empty(n, np.int64), np.empty(n, np.float32), np.empty(n, np.float32)


def _as_floats(weights: PixelWeights) -> PixelWeights:
    """Return the same weights as floats: numba compiles anew for whole numbers."""
    return PixelWeights(*map(float, weights))

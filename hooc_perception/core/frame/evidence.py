# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""All pixels of all views in a row, and hypotheses held against them."""

from dataclasses import dataclass

from hooc_perception.core.frame.kernels import compare as kernel
from hooc_perception.core.frame.kernels import pixel_lists
from hooc_perception.core.geometry import inverse
from hooc_perception.core.render import is_closed
import numpy as np

# What is shown already at each pixel: owner, depth and cost of the nearest and of the next object.
Context = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]


@dataclass(frozen=True)
class PixelWeights:
    """
    What a pixel costs; an unexplained foreground pixel costs 1, a visible table pixel 0.

    :ivar tolerance_m: depth residual that costs as much as no explanation, metres.
    :ivar normal: cost of a perpendicular normal.
    :ivar category: cost of a category that the classifier rules out.
    :ivar free: cost of hiding a surface that was measured farther away.
    """

    tolerance_m: float = 0.03
    normal: float = 0.4
    category: float = 0.4
    free: float = 0.7


@dataclass(frozen=True)
class PixelLists:
    """
    The pixels that each of m hypotheses covers alone, as core.energy.compositor takes them.

    :ivar offsets: (m + 1,) int64; entries offsets[k]:offsets[k + 1] belong to row k.
    :ivar pixel: (E,) int64; depth (E,) float32 metres; cost (E,) float32.
    """

    offsets: np.ndarray
    pixel: np.ndarray
    depth: np.ndarray
    cost: np.ndarray

    def take(self, rows):
        """Return the lists of the given rows."""
        n = np.diff(self.offsets)[rows]
        at = np.concatenate([[0], np.cumsum(n)])
        return PixelLists(at, *pixel_lists.packed(self.offsets[:-1][rows], at, self.pixel,
                                                  self.depth, self.cost))

    def extended(self, other):
        """Return these rows followed by those of `other`."""
        return PixelLists(np.concatenate([self.offsets, self.offsets[-1] + other.offsets[1:]]),
                          *(np.concatenate([getattr(self, f), getattr(other, f)])
                            for f in ('pixel', 'depth', 'cost')))


class Evidence:
    """
    The views of one frame set, laid out for the kernels; pixels are numbered through.

    :param cloud: Cloud of the observation; `patch` (n,) labels of its points.
    """

    def __init__(self, observation, probabilities, models, cloud, patch, stride=1):
        """Flatten and stack every `stride`-th row and column once."""
        s = stride
        # Costs in pixels of the full images shrink with the pixels that are looked at.
        self.scale = 1.0 / (s * s)
        depth = [v.depth[::s, ::s] for v in observation.views]
        self.size = np.array([d.shape[::-1] for d in depth], np.int64)
        self.first = np.concatenate([[0], np.cumsum(self.size.prod(1))]).astype(np.int64)
        T = [inverse(v.camera.T_world_camera) for v in observation.views]
        self.K = np.stack([np.asarray(v.camera.K, np.float64) for v in observation.views])
        self.K[:, :2] /= s
        self.R = np.ascontiguousarray(np.stack([t[:3, :3] for t in T]))
        self.t = np.ascontiguousarray(np.stack([t[:3, 3] for t in T]))

        def flat(images):
            return np.concatenate([x[::s, ::s].reshape(-1, *x.shape[2:]) for x in images])

        self.depth = flat([v.depth for v in observation.views])
        self.foreground = flat([v.foreground for v in observation.views])
        self.normals = flat(cloud.view_normals)
        self.row = flat(cloud.row)
        self.n_points = len(patch)
        self.patch = np.where(self.row >= 0, patch[self.row] if len(patch) else -1,
                              -1).astype(np.int32)
        self.patch_size = np.maximum(np.bincount(self.patch[self.patch >= 0], minlength=1), 1)
        self.p = np.ascontiguousarray(probabilities.p)
        p_row = [np.full(v.depth.shape, -1, np.int32) for v in observation.views]
        for k, image in enumerate(p_row):
            mine = np.flatnonzero(probabilities.camera == k)
            image[probabilities.uv[mine, 1], probabilities.uv[mine, 0]] = mine
        self.p_row = flat(p_row)
        self.vertices = np.concatenate([m.vertices for m in models])
        self.faces = np.concatenate([m.faces for m in models]).astype(np.int32)
        self.vertex_start = np.cumsum([0] + [len(m.vertices) for m in models])
        self.face_start = np.cumsum([0] + [len(m.faces) for m in models])
        self.cost_none = self.foreground.astype(np.float32)
        nothing = np.full(len(self.depth), np.inf, np.float32)
        self.nothing = (np.full(len(self.depth), -2, np.int32), nothing, self.cost_none,
                        nothing, self.cost_none)
        self._shared = (self.K, self.R, self.t, self.size, self.first, self.depth,
                        self.foreground, self.normals, self.patch, self.patch_size, self.p,
                        self.p_row)
        self._meshes = (self.vertices, self.vertex_start, self.faces, self.face_start,
                        np.array([is_closed(m) for m in models]))

    def explain(self, hypotheses, category, weights, context=None, lists=False, me=None):
        """
        Hold hypotheses (m, 10) of categories (m,) against all views.

        :param context: what is shown already, from `compose`; default nothing.
        :param lists: also return the pixel lists for core.energy.compositor.
        :param me: (m,) rows of the hypotheses in `context`, which they are to look through.
        :return: stats (m, STATS), see kernels/explain.py; with `lists` also a PixelLists.
        """
        H = np.ascontiguousarray(hypotheses[:, :10], np.float64)
        category = np.ascontiguousarray(category, np.int64)
        context = self.nothing if context is None else context

        me = np.full(len(H), -1) if me is None else np.asarray(me, np.int64)

        def run(emit_at, pixel, depth, cost):
            return kernel.explain_all(
                H, category, me, *self._meshes, context, *self._shared, weights.tolerance_m,
                weights.normal, weights.category, weights.free, emit_at, pixel, depth, cost)

        if not lists:
            nowhere = np.full(len(H), -1), np.zeros(0, np.int64), *np.zeros((2, 0), np.float32)
            return run(*nowhere)[0]
        # Room for all pixels of their windows; what is never written to takes no memory.
        room = pixel_lists.window_areas(H, category, *self._meshes[:2], self.K, self.R, self.t,
                                        self.size)
        starts = np.cumsum(room) - room
        loose = [np.empty(room.sum(), t) for t in (np.int64, np.float32, np.float32)]
        stats, n = run(starts, *loose)
        offsets = np.concatenate([[0], np.cumsum(n)])
        return stats, PixelLists(offsets, *pixel_lists.packed(starts, offsets, *loose))

    def compose(self, members, lists):
        """Return the context that the given rows of PixelLists make, nearest wins."""
        context = tuple(a.copy() for a in self.nothing)
        pixel_lists.compose(np.asarray(members, np.int64), lists.offsets, lists.pixel,
                            lists.depth, lists.cost, *context)
        return context

    def unexplained(self, context=None):
        """Return (n,) float64, the share of each cloud point's pixels that nothing explains."""
        seen = self.row >= 0
        cost = (self.cost_none if context is None else context[2])[seen]
        total = np.bincount(self.row[seen], minlength=self.n_points)
        left = np.bincount(self.row[seen], weights=cost > 0.6, minlength=self.n_points)
        return left / np.maximum(total, 1)

    def polish(self, hypotheses, category, me, context, weights, complexity, prior, n_steps,
               sigmas, rng):
        """
        Return a refined copy of hypotheses (m, 10), each on its own in its `context`.

        :param me: (m,) the rows that they replace there, -1 for none.
        :param sigmas: first step lengths: metres, radians, log scale.
        """
        H = np.ascontiguousarray(hypotheses[:, :10], np.float64).copy()
        seeds = rng.integers(0, 2**31, len(H))
        kernel.polish_all(
            seeds, H, np.ascontiguousarray(category, np.int64), np.asarray(me, np.int64),
            *self._meshes, context, *self._shared, weights.tolerance_m, weights.normal,
            weights.category, weights.free, complexity, prior, n_steps, *sigmas)
        return H


def hypotheses_of(candidates, models):
    """Return (n, 10) float64 hypotheses of Candidates: translation, xyzw, scale per axis."""
    extents = np.array([models[c - 1].extents for c in candidates.category]).reshape(-1, 3)
    return np.column_stack([candidates.translation, candidates.rotation_xyzw,
                            candidates.size / np.maximum(extents, 1e-9)]).astype(np.float64)

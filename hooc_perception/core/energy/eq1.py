# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
The energy of Eq. 1 (Basevi & Leonardis 2016, section 4) for any subset of candidates.

    E = (1/Npix) sum_i min(|d_i - d~_i|, dmax) / dmax + (1/Npix) sum_i (1 - p_i)
        + (1/Nobj) sum_k v_k

`d` is the depth of the posed models and the empty scene, nearest wins, `d~` the measured one,
`p_i` the probability of the category shown at pixel i (background where none is), `v_k`
the share of object k's volume inside any other chosen object. Npix is the number of pixels, Nobj
that of chosen objects. Where the paper is silent:

- Npix counts the pixels of all views that have a reading; the others are left out.
- Where the empty scene's depth is unknown, showing it costs no depth: no claim is made there.
- Pixels that PixelProbabilities does not list are background with certainty.
- The overlap of the empty subset is 0.
"""

from collections.abc import Sequence

from hooc_perception.core.arrays import AnyArray, BoolArray, Float32Array, Float64Array, Int64Array
from hooc_perception.core.energy.compositor import Compositor
from hooc_perception.core.energy.images_and_volumes import ImagesAndVolumes
from hooc_perception.core.energy.overlap import OverlapTerm
from hooc_perception.core.frame.pixel_index import first_pixels, rows_of_pixels, stacked_index
from hooc_perception.core.geometry import posed_vertices
from hooc_perception.core.render import render_patch
from hooc_perception.core.types import (
    Candidates,
    Energy,
    GenericModel,
    Observation,
    PixelProbabilities,
)
import numpy as np

# Truncation of a depth residual (the paper's 100 mm).
D_MAX_M = 0.1


def pixel_lists(observation: Observation, objects: Candidates, models: Sequence[GenericModel],
                ) -> tuple[Int64Array, Int64Array, Float32Array]:
    """
    Render every object alone into every view.

    :return: (offsets (n + 1,) int64, pixel (E,) int64, depth (E,) float32 metres); entries
        offsets[k]:offsets[k + 1] belong to object k; the pixels of all views share one
        numbering, see core/frame/pixel_index.py.
    """
    first = first_pixels(observation.views)
    counts, pixels, depths = [0], [np.zeros(0, np.int64)], [np.zeros(0, np.float32)]
    for k, model in enumerate(objects.shapes(models)):
        vertices = posed_vertices(model, objects.translation[k], objects.rotation_xyzw[k],
                                  objects.size[k])
        count = 0
        for view, base in zip(observation.views, first):
            pixel, depth = render_patch(vertices, model.faces, view.camera)
            pixels.append(pixel + base)
            depths.append(depth)
            count += len(pixel)
        counts.append(count)
    return np.cumsum(counts), np.concatenate(pixels), np.concatenate(depths)


class Eq1(ImagesAndVolumes):
    """
    Eq. 1 over the subsets of a pool, with everything that a search needs.

    See core/energy/compositor.py for `mask`, `value`, `deltas`, `flip`, `reset` and `evaluate`.

    :param pool: Candidates; class id c is models[c - 1].
    :param max_instances: most chosen candidates per category; 0 = no limit, as in the paper.
    :param d_max: truncation of a depth residual, metres.
    """

    def __init__(self, observation: Observation, probabilities: PixelProbabilities,
                 pool: Candidates, models: Sequence[GenericModel], max_instances: int = 0,
                 d_max: float = D_MAX_M) -> None:
        """Render the candidates into all views and compare their volumes."""
        self.n = len(pool)
        measured = np.concatenate([view.depth.ravel() for view in observation.views])
        background = np.concatenate([view.background.ravel() for view in observation.views])
        read = np.isfinite(measured)
        self.n_pixels = max(int(read.sum()), 1)
        row = rows_of_pixels(stacked_index(observation.views, probabilities.camera,
                                           probabilities.uv), len(measured))
        # A last row for all pixels that are not listed: background with certainty.
        miss = 1.0 - np.vstack([probabilities.p, np.zeros((1, probabilities.p.shape[1]))]) / 255.0
        miss[-1, 0] = 0.0

        none_depth = np.where(np.isfinite(background), np.abs(background - measured), 0.0)
        self._none_depth = np.where(read, np.minimum(none_depth, d_max) / d_max, 0.0)
        self._none_miss = np.where(read, miss[row, 0], 0.0)

        offsets, pixel, depth = pixel_lists(observation, pool, models)
        owner = np.repeat(np.arange(self.n), np.diff(offsets))
        kept = read[pixel] & ~(depth > background[pixel])
        offsets = np.concatenate([[0], np.cumsum(kept)])[offsets]
        owner, pixel, depth = owner[kept], pixel[kept], depth[kept]
        self._depth = np.minimum(np.abs(depth - measured[pixel]), d_max) / d_max
        self._miss = miss[row[pixel], pool.category[owner]]

        super().__init__(
            Compositor(offsets, pixel, depth, self._depth + self._miss,
                       self._none_depth + self._none_miss, group=pool.category,
                       max_per_group=max_instances), OverlapTerm(pool, models))

    @property
    def value(self) -> float:
        """Return E (Eq. 1) of the current subset."""
        n = np.count_nonzero(self._images.mask)
        return self._images.value / self.n_pixels + self._overlap.value / max(n, 1)

    def deltas(self) -> Float64Array:
        """Return (n,) float64: the change of E by each flip, inf where it is not allowed."""
        mask, shares = self._images.mask, self._overlap.value
        n = np.count_nonzero(mask)
        mean = (shares + self._overlap.deltas()) / np.maximum(n + np.where(mask, -1, 1), 1)
        return self._images.deltas() / self.n_pixels + mean - shares / max(n, 1)

    def deltas_without(self, members: Int64Array) -> Float64Array:
        """Return (m, n) float64: the change by adding each outsider once a member has left."""
        n = np.count_nonzero(self._images.mask) - 1
        shares = (self._overlap.value + self._overlap.deltas()[members])[:, None]
        mean = (shares + self._overlap.deltas_without(members)) / (n + 1)
        return (self._images.deltas_without(members) / self.n_pixels + mean
                - shares / max(n, 1))

    def evaluate(self, mask: BoolArray) -> float:
        """Return E of the subset `mask` (n,) bool; the current one stays."""
        n = max(np.count_nonzero(mask), 1)
        return self._images.evaluate(mask) / self.n_pixels + self._overlap.evaluate(mask) / n

    def energy(self, mask: BoolArray) -> Energy:
        """Return the three terms of Eq. 1 for the subset `mask` (n,) bool, not rounded."""
        entry = self._images.entries_shown(mask)
        seen, pixels = entry >= 0, self._images.pixels
        hidden = pixels[seen]

        def total(none: AnyArray, shown: AnyArray) -> float:
            return float(none.sum() - none[hidden].sum() + shown[entry[seen]].sum())

        return Energy(total(self._none_depth, self._depth) / self.n_pixels,
                      total(self._none_miss, self._miss) / self.n_pixels,
                      float(self._overlap.evaluate(mask)) / max(np.count_nonzero(mask), 1))


def energy_of(observation: Observation, probabilities: PixelProbabilities, objects: Candidates,
              models: Sequence[GenericModel]) -> Energy:
    """Return the Energy of a set of objects, all of them shown; for reports."""
    return Eq1(observation, probabilities, objects, models).energy(np.ones(len(objects), bool))

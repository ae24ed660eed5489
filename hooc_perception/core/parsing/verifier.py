# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Stage 4, last step: the probability that each candidate is right.

The joint energy compares explanations of a scene; it does not know that a fork is seldom seen
well or that a can is often mistaken for a glass. A small forest, learned from parsed synthetic
scenes alone (training/fit_verifier.py), gives every candidate in the running the probability
that it is right, from how well it fits, what the classifier says, and its marginal energy.
"""

from collections.abc import Mapping, Sequence

from hooc_perception.core.arrays import (
    AnyArray,
    BoolArray,
    Float32Array,
    Float64Array,
    UInt16Array,
)
from hooc_perception.core.classification.forest import Forest
from hooc_perception.core.energy.joint import JointEnergy
from hooc_perception.core.frame.evidence import Evidence
from hooc_perception.core.frame.kernels import compare as kernel
from hooc_perception.core.frame.kernels.outline import outlines
from hooc_perception.core.frame.kernels.pixel_lists import mean_probabilities, PixelLists
from hooc_perception.core.parsing.search import Search
from hooc_perception.core.types import Candidates, GenericModel
from hooc_perception.errors import HoocError
import numpy as np

FEATURES = (
    'margin', 'margin a pixel', 'category margin', 'log pixels', 'agree', 'behind', 'violate',
    'missing', 'gain', 'cosine', 'residual', 'share', 'unlikeliness', 'delta', 'scale',
    'largest scale', 'spread of scale', 'height', 'views', 'foreground', 'own p', 'rank of p',
    'p against best', 'classes', 'log generic area', 'slimness', 'category', 'open outline',
    'ending outline')

# A verifier may know only so many of them, from the first on.
FIRST_FEATURES = 27


class Verifier:
    """
    The probability that a candidate is right.

    :param forest: Forest over FEATURES with two classes, wrong and right.
    """

    def __init__(self, forest: Forest) -> None:
        """Wrap a forest."""
        self.forest = forest

    @staticmethod
    def from_arrays(classifier: Mapping[str, AnyArray]) -> 'Verifier | None':
        """
        Return the Verifier of a classifier's arrays, None where training made none.

        :raises HoocError: where it asks for other features than this version computes.
        """
        if 'verifier_feature' not in classifier:
            return None
        forest = Forest.from_arrays(classifier, 'verifier_')
        known = int(classifier.get('verifier_features', 0))
        # Features are added at the end, so that a verifier of before still reads its own.
        if (forest.feature.max() >= known or forest.leaf_p.shape[1] != 2
                or not FIRST_FEATURES <= known <= len(FEATURES)):
            raise HoocError('the verifier of the model does not fit this version; train again')
        return Verifier(forest)

    def probability(self, x: Float32Array) -> Float64Array:
        """Return (n,) float64 for feature rows x (n, FEATURES) float32."""
        return self.forest.predict(x)[:, 1].astype(np.float64)


def margins(energy: JointEnergy, siblings: BoolArray) -> Float64Array:
    """
    Return (n,) float64: the marginal energy of the object behind each candidate, in pixels.

    Least energy with the candidate minus least energy without it and without its siblings,
    other candidates for the same object. One exchange may make up for the change, which is what
    a local optimum leaves to gain. Negative: the scene is explained worse without that object.

    :param energy: JointEnergy at its optimum.
    :param siblings: (n, n) bool, symmetric, True on the diagonal.
    """
    members = np.flatnonzero(energy.mask)
    joining = np.where(energy.mask, 0.0, energy.joining_costs())
    leave = energy.deltas()[members]
    swapped = leave[:, None] + energy.deltas_without(members)
    joining = np.minimum(joining, swapped.min(axis=0, initial=np.inf))
    without = np.full(energy.n, -np.inf)
    for i, a in enumerate(members):
        replaced = np.where(siblings[a], np.inf, swapped[i]).min(initial=leave[i])
        without[siblings[a]] = np.maximum(without[siblings[a]], replaced)
    joining[members] = 0.0
    return joining - np.where(np.isfinite(without), without, 0.0)


def siblings_of(pool: Candidates, models: Sequence[GenericModel]) -> BoolArray:
    """Return (n, n) bool: same category, centres within 0.35 of the model's longest side."""
    reach = 0.35 * np.array([shape.longest_side for shape in pool.shapes(models)])
    apart = np.linalg.norm(pool.translation[:, None] - pool.translation[None], axis=2)
    return (pool.category[:, None] == pool.category[None]) & (apart < reach[:, None])


def features(search: Search) -> Float32Array:
    """Return (n, FEATURES) float32 of all candidates in the pool of a search at its optimum."""
    evidence, pool, stats, models = search.evidence, search.pool, search.stats, search.models
    n = len(pool)
    if not n:
        return np.zeros((0, len(FEATURES)), np.float32)
    margin = margins(search.energy, siblings_of(pool, models)) / evidence.scale
    shown = np.maximum(stats[:, kernel.SHOWN], 1)
    agree = np.maximum(stats[:, kernel.AGREE], 1)
    extents = np.array([shape.extents for shape in pool.shapes(models)])
    scale = np.log(pool.size / np.maximum(extents, 1e-9))
    p, foreground = _opinions(evidence, search.lists, n)
    own = p[np.arange(n), pool.category]
    rest = p[:, 1:].copy()
    rest[np.arange(n), pool.category.astype(int) - 1] = 0
    rival = rest.max(1)
    ordered = np.sort(extents, 1)
    area = ordered[:, 2] * ordered[:, 1]
    columns = (
        np.sign(margin) * np.log1p(np.abs(margin) / 10), margin * evidence.scale / (shown + 50),
        _category_margin(margin, pool.category), np.log(shown / evidence.scale),
        stats[:, kernel.AGREE] / shown, stats[:, kernel.BEHIND] / shown,
        stats[:, kernel.VIOLATE] / shown, stats[:, kernel.MISSING] / shown,
        stats[:, kernel.GAIN] / agree, stats[:, kernel.COS] / agree,
        stats[:, kernel.RESIDUAL] / agree, stats[:, kernel.SHARE],
        stats[:, kernel.UNLIKELINESS] / agree, stats[:, kernel.DELTA] / shown,
        scale.mean(1), np.abs(scale).max(1), np.ptp(scale, axis=1), pool.translation[:, 2],
        stats[:, kernel.VIEWS], foreground, own, (rest > own[:, None]).sum(1),
        np.log((own + 0.01) / (rival + 0.01)), np.full(n, p.shape[1] - 1), np.log(area),
        ordered[:, 2] / np.maximum(ordered[:, 0], 1e-4), pool.category,
        *outlines(search.lists, evidence.views).T)
    return np.column_stack(columns).astype(np.float32)


def _category_margin(margin: Float64Array, category: UInt16Array) -> Float64Array:
    """Return (n,) each candidate's log-like distance to the best other one of its category."""
    out = np.zeros(len(margin))
    for c in np.unique(category):
        mine = np.flatnonzero(category == c)
        order = mine[np.argsort(margin[mine], kind='stable')]
        first = margin[order[0]]
        second = margin[order[1]] if len(order) > 1 else first + 1e3
        out[mine] = margin[mine] - first
        out[order[0]] = first - second
    return np.sign(out) * np.log1p(np.abs(out) / 10)


def _opinions(evidence: Evidence, lists: PixelLists, n: int,
              ) -> tuple[Float64Array, Float64Array]:
    """Return ((n, N + 1) mean class probabilities, (n,) share of foreground) of the pixels."""
    p, front = np.zeros((n, evidence.views.p.shape[1])), np.zeros(n)
    mean_probabilities(lists, evidence.views, p, front)
    covered = np.maximum(np.diff(lists.offsets), 1)
    return p, front / covered

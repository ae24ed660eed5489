# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Uncertainty of pose and size of each object, from what its pixels tell.

Covariance as in least squares: pose and size are as certain as the pixels change while the
object moves, relative to the remaining residual. A half-hidden plate leaves its centre open, a
box its depth where the far side is out of sight. The difference between real objects and generic
models, which no pixel tells, grows with the object. Then every half turn about the model's axes
is refined: one that costs hardly more may be the true one. All of it was calibrated on synthetic
scenes (docs/planners.md says how well it holds).
"""

from collections.abc import Sequence

from hooc_perception.core.arrays import Float32Array, Float64Array, Int64Array
from hooc_perception.core.frame.costs import ObjectCosts, PixelCosts
from hooc_perception.core.frame.evidence import Evidence, hypotheses_of
from hooc_perception.core.frame.frame import Frame
from hooc_perception.core.frame.kernels import compare as stat
from hooc_perception.core.frame.kernels.records import RefineSettings
from hooc_perception.core.parsing.search import STEPS
from hooc_perception.core.symmetry import half_turns, is_ball
from hooc_perception.core.types import Candidates, GenericModel, ParsedScene
import numpy as np
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

# How far an object is moved to see what its pixels say: a pixel of a Kinect covers 3 mm.
STEP_M = 0.003
POLISH_STEPS = 20
# What is known without the images: metres, radians, log scale.
PRIOR = (0.05, 0.5, 0.12)
# Calibrated on three twins (27 scenes, 274 objects) other than those of the docs: 68 % of the
# errors lie within sigma, of the surest quarter of the objects as of the least sure. HEAT: pixels
# that say as much as one alone, where the residual is TYPICAL_M: neighbours err alike.
HEAT, TYPICAL_M, LEAST_M = 300.0, 0.003, 0.0015
SHAPE = 0.06                # error from the shape of the object, share of its longest side
PER_SQUARE_M, SCALE_R = 28.2, 0.44
# A half turn whose cost rises by this share of the object's pixels is as likely as the answer; the
# odds fall by e for every WIDTH more.
FLIP_EVEN, FLIP_WIDTH = 0.02, 0.012
WITHIN = 0.68


def pose_uncertainty(frame: Frame, parsed: ParsedScene, pixels: PixelCosts,
                     costs: ObjectCosts, rng: np.random.Generator,
                     rows: Int64Array | None = None) -> Float32Array:
    """
    Return (sigma_t (n,), sigma_r (n,)) float32 of the objects of a ParsedScene.

    sigma_t, metres: 68 % of the centres lie within it of the true one. sigma_r, radians: the
    same of the rotation up to the model's symmetry; pi where a half turn is so likely that less
    would not do; NaN for a ball. Both assume that the category is right.

    :param pixels: of the energy, like `costs`.
    :param rows: of the objects that it is asked for, NaN for the others; None = all.
    """
    objects = parsed.objects
    n = len(objects)
    rows = np.arange(n) if rows is None else rows
    if not len(rows):
        return np.full((2, n), np.nan, np.float32)
    models = frame.models
    cost = _Cost(frame.coarse, objects, models, pixels, costs)
    shapes = objects.shapes(models)
    longest = np.array([shape.longest_side for shape in shapes])
    information = _information(cost, longest, rows)
    flipped = _flip_probabilities(cost, objects, models, rng, rows)
    out = np.full((2, n), np.nan, np.float32)
    for i, k in enumerate(rows.tolist()):
        half = float(longest[k]) / 2
        units = np.repeat([1.0, half, half], 3)     # metres at the surface
        heat = HEAT * (max(float(parsed.residual_m[k]), LEAST_M) / TYPICAL_M) ** 2
        covariance = np.linalg.inv(information[i] / heat + np.diag(
            (np.repeat(PRIOR, 3) * units) ** -2.0))
        # Errors spread wider than least squares think: sigma goes with the variance.
        variance = np.trace(covariance[:3, :3]) + (SHAPE * longest[k]) ** 2
        out[0, k] = min(PER_SQUARE_M * variance, longest[k])
        symmetry = shapes[k].symmetry
        if is_ball(symmetry):
            continue
        turning = covariance[3:6, 3:6]
        for axis in np.flatnonzero(np.asarray(symmetry) == 0):
            along = Rotation.from_quat(objects.rotation_xyzw[k]).as_matrix()[:, axis]
            across = np.eye(3) - np.outer(along, along)
            turning = across @ turning @ across
        if 1 - flipped[i] <= WITHIN:
            out[1, k] = np.pi
        else:
            local = SCALE_R * np.sqrt(np.trace(turning)) / half
            out[1, k] = min(np.pi, local * _wider(flipped[i]))
    return out


class _Cost:
    """The cost of the scene with one object posed and sized otherwise."""

    def __init__(self, evidence: Evidence, objects: Candidates, models: Sequence[GenericModel],
                 pixels: PixelCosts, costs: ObjectCosts) -> None:
        """Compose the objects."""
        self.evidence, self.costs = evidence, costs
        self.weights = pixels.weights()
        self.H, self.shape = hypotheses_of(objects, evidence.shapes), evidence.shapes.of(objects)
        _, lists = evidence.compare_pixels(self.H, self.shape, self.weights)
        self.context = evidence.compose(np.arange(len(objects)), lists)

    def of(self, H: Float64Array, own: Int64Array) -> tuple[Float64Array, Float64Array]:
        """Return (m,) costs in pixels of the full images, and (m,) pixels that are shown."""
        stats = self.evidence.compare(H, self.shape[own], self.weights, self.context, own)
        prior = self.costs.size_prior * (np.log(H[:, 7:10]) ** 2).sum(1)
        shown = stats[:, stat.SHOWN] / self.evidence.scale
        return (stats[:, stat.DELTA] / self.evidence.scale
                + shown * (self.costs.complexity + prior)), shown

    def refined(self, H: Float64Array, own: Int64Array, rng: np.random.Generator) -> Float64Array:
        """Return hypotheses refined for some steps, each in place of its object."""
        c = self.costs
        return self.evidence.refine(
            H, self.shape[own], self.weights,
            RefineSettings(c.complexity, c.size_prior, POLISH_STEPS, *STEPS), rng, self.context,
            own)


def _wider(p_flip: float) -> float:
    """Return the factor that makes WITHIN of all errors out of WITHIN of those without a flip."""
    return float(np.sqrt(chi2.ppf(WITHIN / (1 - p_flip), 3) / chi2.ppf(WITHIN, 3)))


def _information(cost: _Cost, longest: Float64Array, rows: Int64Array) -> Float64Array:
    """
    Return (rows, 9, 9), what the pixels say of pose and size: the sum of J J', in 1 / m^2.

    J is the change of a pixel's signed residual, in tolerances and at most 1, while the object
    moves, turns and grows by STEP_M at its surface, there and back. At outlines pixels change
    hands, which counts as much as a tolerance.
    """
    n, evidence, tolerance = len(rows), cost.evidence, cost.weights.tolerance_m
    moves = np.concatenate([np.eye(9), -np.eye(9)]) * STEP_M
    own = np.repeat(rows, len(moves))
    flat = np.tile(moves, (n, 1))
    H, half = cost.H[own], longest[own, None] / 2
    H[:, :3] += flat[:, :3]
    H[:, 3:7] = (Rotation.from_rotvec(flat[:, 3:6] / half)
                 * Rotation.from_quat(H[:, 3:7])).as_quat()
    H[:, 7:10] *= np.exp(flat[:, 6:9] / half)
    _, lists = evidence.compare_pixels(H, cost.shape[own], cost.weights, cost.context, own)
    residual = np.clip((lists.depth - evidence.views.depth[lists.pixel]) / tolerance, -1, 1)
    out = np.zeros((n, 9, 9))
    for k in range(n):
        first, last = lists.offsets[18 * k], lists.offsets[18 * (k + 1)]
        pixels, at = np.unique(lists.pixel[first:last], return_inverse=True)
        # Without the object the table is seen: too far for foreground, right for all else.
        r = np.tile(evidence.views.foreground[pixels].astype(float), (18, 1))
        move = np.repeat(np.arange(18), np.diff(lists.offsets[18 * k:18 * (k + 1) + 1]))
        r[move, at] = residual[first:last]
        J = (r[:9] - r[9:]) / (2 * STEP_M)
        out[k] = J @ J.T / evidence.scale
    return out


def _flip_probabilities(cost: _Cost, objects: Candidates, models: Sequence[GenericModel],
                        rng: np.random.Generator, rows: Int64Array) -> Float64Array:
    """Return (rows,) how likely a half turn of the answer is the true orientation."""
    turned, of_row = half_turns(objects.take(rows), models)
    H = np.concatenate([cost.H[rows], hypotheses_of(turned, cost.evidence.shapes)])
    own = np.concatenate([rows, rows[of_row]])
    costs, shown = cost.of(cost.refined(H, own, rng), own)
    out, n = np.zeros(len(rows)), len(rows)
    for i, k in enumerate(rows):
        others = np.flatnonzero(own[n:] == k) + n
        if len(others):
            rise = (costs[others].min() - costs[i]) / max(shown[i], 1.0)
            out[i] = 1 / (1 + np.exp((rise - FLIP_EVEN) / FLIP_WIDTH))
    return out

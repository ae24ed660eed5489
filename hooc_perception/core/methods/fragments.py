# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Pose candidates from object fragments (Basevi & Leonardis 2016, section 4).

Per category, 200 times: a central pixel is drawn from the category's probability images over
all views; its 3D point sets a bounding region in each view; the likely pixels in there give
the fragment, one cloud of 3D points from all views. A generic model of random fixed size, at a
random pose, is aligned with the fragment by ICP. The 5 best per category are kept.

The paper leaves open, and we chose: the gates that make a pixel likely, the range of sizes, the
two passes of ICP, and the score. The score is one minus the mean of two truncated residuals: of
the fragment to the model, and of the model's visible surface to the measured depth.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from hooc_perception.core.arrays import Float64Array, Int32Array, Int64Array, UInt8Array
from hooc_perception.core.config import Config, param
from hooc_perception.core.frame.pixel_index import first_pixels, rows_of_pixels, stacked_index
from hooc_perception.core.geometry import inverse
from hooc_perception.core.methods.icp import model_cloud
from hooc_perception.core.methods.kernels import fragments as kernels
from hooc_perception.core.methods.kernels.fragments import Draws, Images, Listed, Rules
from hooc_perception.core.types import Candidates, GenericModel, Observation, PixelProbabilities
import numpy as np
from scipy.spatial.transform import Rotation


@dataclass(frozen=True)
class FragmentConfig(Config):
    """Parameters of the `paper` profile's candidates; (paper) = the value is published."""

    draws: int = param(200, 'Fragments drawn per category (paper).', low=1)
    keep: int = param(5, 'Candidates kept per category (paper).', low=1)
    size_low: float = param(
        0.7, 'Smallest random size, as a multiple of the generic model; real objects differ '
        'from generic ones by factors of about 0.65 to 1.4 along an axis.', low=0.1, high=10.0)
    size_high: float = param(1.4, 'Largest random size, see size_low.', low=0.1, high=10.0)
    region: float = param(
        1.0, 'Half side of the bounding region as a multiple of the longest side of the model '
        'at its drawn size: the central pixel may lie at one end of the object and the other '
        'end has to be inside.', low=0.1, high=5.0)
    likely: float = param(
        0.5, 'A pixel is likely if its probability is at least this share of that of the '
        'central pixel; 25 categories split the mass so finely that no fixed threshold suits '
        'both sure and unsure categories.', low=0.0, high=1.0)
    fewest: int = param(20, 'Fragments of fewer pixels are discarded.', low=6)
    most: int = param(128, 'Points that a fragment is thinned to.', low=6)
    shift: float = param(
        0.25, 'Largest random offset of the model from the centroid of the fragment, as a '
        'multiple of its longest side: only one side of the object is visible.',
        low=0.0, high=2.0)
    coarse_points: int = param(48, 'Fragment points used by the coarse ICP passes.', low=6)
    coarse_reach: float = param(
        0.3, 'Largest distance of a pair in the coarse passes, as a share of the longest side; '
        'about as far as the random start is off.', low=0.01, high=0.5)
    coarse_passes: int = param(20, 'Most coarse passes, point to point.', low=0)
    fine_reach: float = param(
        0.1, 'Largest distance of a pair in the fine passes, as a share of the longest side; '
        'beyond it lie neighbouring objects in the same region.', low=0.01, high=0.5)
    fine_passes: int = param(20, 'Most fine passes, point to plane.', low=0)
    truncation_m: float = param(
        0.02, 'Residuals are truncated at this value: several times the noise of a Kinect, '
        'less than most objects.', unit='m', low=0.001, high=0.2)
    score_points: int = param(256, 'Model points that are scored.', low=16)


def propose_fragments(observation: Observation, probabilities: PixelProbabilities,
                      models: Sequence[GenericModel], config: FragmentConfig = FragmentConfig(),
                      rng: np.random.Generator | None = None) -> Candidates:
    """
    Propose the candidates of every category, at most `keep` each.

    :param probabilities: of the pixels of `observation`.
    :param models: class id c is models[c - 1].
    :return: Candidates by category, best first; a category that no pixel shows has none.
    """
    rng = np.random.default_rng(0) if rng is None else rng
    scene = scene_arrays(observation, probabilities)
    pool = Candidates.empty()
    for c, model in enumerate(models, 1):
        p = probabilities.p[scene.kept, c]
        if p.any():
            pool = pool.extended(_category(scene, p, c, model, config, rng))
    return pool


@dataclass(frozen=True)
class SceneArrays:
    """
    What the kernels read of a scene.

    :ivar kept: (M,) rows of the PixelProbabilities whose pixel has a reading.
    :ivar points: (M, 3) float64 world points of these pixels, metres.
    :ivar row: (P,) int32 index into `kept` for every pixel of all views, or -1.
    """

    images: Images
    kept: Int64Array
    points: Float64Array
    row: Int32Array


def scene_arrays(observation: Observation, probabilities: PixelProbabilities) -> SceneArrays:
    """Return the SceneArrays of an observation and its class probabilities."""
    views = observation.views
    images = Images(
        first=first_pixels(views)[:-1],
        width=np.array([view.depth.shape[1] for view in views], np.int64),
        height=np.array([view.depth.shape[0] for view in views], np.int64),
        K=np.stack([np.asarray(view.camera.K, np.float64) for view in views]),
        T_camera_world=np.stack([inverse(view.camera.T_world_camera) for view in views]),
        centre=np.stack([view.camera.T_world_camera[:3, 3] for view in views]),
        depth=np.concatenate([view.depth.ravel() for view in views]).astype(np.float32))
    at = stacked_index(views, probabilities.camera, probabilities.uv)
    kept = np.flatnonzero(np.isfinite(images.depth[at]))
    at = at[kept]
    camera = probabilities.camera[kept].astype(np.int64)
    u, v = probabilities.uv[kept].astype(np.int64).T
    z = images.depth[at].astype(np.float64)
    K = images.K[camera]
    local = np.stack([(u - K[:, 0, 2]) / K[:, 0, 0] * z, (v - K[:, 1, 2]) / K[:, 1, 1] * z, z])
    T_world_camera = np.stack([view.camera.T_world_camera for view in views])[camera]
    points = np.einsum('nij,jn->ni', T_world_camera[:, :3, :3], local) + T_world_camera[:, :3, 3]
    return SceneArrays(images, kept, points, rows_of_pixels(at, len(images.depth)))


def _category(scene: SceneArrays, p: UInt8Array, c: int, model: GenericModel,
              config: FragmentConfig, rng: np.random.Generator) -> Candidates:
    """Return the best candidates of class c; `p` (M,) uint8 its probabilities, not all zero."""
    target, longest = model_cloud(model), model.longest_side
    draws = _drawn(p, longest, config, rng)
    rules = Rules(
        config.coarse_reach * longest, config.fine_reach * longest, config.coarse_points,
        config.coarse_passes, config.fine_passes, config.fewest, config.most,
        config.truncation_m, max(1, len(target.points) // config.score_points))
    R, t, score = kernels.propose(draws, Listed(scene.row, scene.points, p), target,
                                  scene.images, rules)
    best = np.argsort(-score, kind='stable')[:config.keep]
    best = best[score[best] >= 0]
    size = (np.asarray(model.extents) * draws.scale[best, None]).astype(np.float32)
    rotation = (Rotation.from_matrix(R[best]).as_quat(canonical=True) if len(best)
                else np.zeros((0, 4)))
    return Candidates(np.full(len(best), c, np.uint16), t[best], rotation, size,
                      score[best].astype(np.float32))


def _drawn(p: UInt8Array, longest: float, config: FragmentConfig,
           rng: np.random.Generator) -> Draws:
    """
    Draw the central pixels, sizes and initial poses of the fragments of one category.

    :param p: (M,) uint8 probability of the category.
    :param longest: longest side of the generic model, metres.
    """
    m = config.draws
    pixel = rng.choice(len(p), m, p=p / p.sum(dtype=np.float64)).astype(np.int32)
    low, high = sorted((config.size_low, config.size_high))
    scale = np.exp(rng.uniform(np.log(low), np.log(high), m))
    R = Rotation.random(m, rng).as_matrix()     # by place: scipy has renamed the argument
    # Uniform in a ball: a random direction and the cube root of a uniform radius.
    shift = rng.normal(size=(m, 3))
    shift *= (config.shift * longest * scale * rng.random(m) ** (1 / 3)
              / np.linalg.norm(shift, axis=1))[:, None]
    least = np.maximum(np.ceil(config.likely * p[pixel]), 1).astype(np.uint8)
    return Draws(pixel, config.region * longest * scale, least, rng.random(m), R, shift, scale)

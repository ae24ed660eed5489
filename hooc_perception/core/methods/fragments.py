# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Pose candidates from object fragments (Basevi & Leonardis 2016, section 4).

Per category, 200 times: a central pixel is drawn from the category's probability images over
all views; its 3D point sets a bounding region in each view; the likely pixels in there give
the fragment, one cloud of 3D points from all views. A generic model of random fixed size, at a
random pose, is aligned with the fragment by ICP. The 5 best of each category are kept.

Ours, where the paper is silent: the gates that make a pixel likely, the range of sizes, ICP's
two passes, and the score, one minus the mean of two truncated residuals: of the fragment to
the model, and of the model's visible surface to what was measured.
"""

from dataclasses import dataclass

from hooc_perception.core.config import Config, param
from hooc_perception.core.geometry import inverse
from hooc_perception.core.methods.icp import model_cloud
from hooc_perception.core.methods.kernels import fragments as kernels
from hooc_perception.core.types import Candidates
import numpy as np
from scipy.spatial.transform import Rotation


@dataclass(frozen=True)
class FragmentConfig(Config):
    """Parameters of the `paper` profile's candidates."""

    draws: int = param(200, 'fragments drawn for each category (paper)', low=1)
    keep: int = param(5, 'candidates kept for each category (paper)', low=1)
    size_low: float = param(
        0.7, 'smallest random size, as a multiple of the generic model; real objects differ '
        'from generic ones by up to about 0.65 to 1.4 along an axis', low=0.1, high=10.0)
    size_high: float = param(1.4, 'largest random size, see size_low', low=0.1, high=10.0)
    region: float = param(
        1.0, 'half side of the bounding region as a multiple of the longest side of the model '
        'at its drawn size: the central pixel may lie at one end of the object and the other '
        'end has to be inside', low=0.1, high=5.0)
    likely: float = param(
        0.5, 'a pixel is likely where its probability is at least this share of that of the '
        'central pixel: 25 categories split the mass so finely that no fixed threshold fits '
        'both sure and unsure categories', low=0.0, high=1.0)
    fewest: int = param(20, 'fragments of fewer pixels than this say nothing about a pose', low=6)
    most: int = param(128, 'points that a fragment is thinned to', low=6)
    shift: float = param(
        0.25, 'largest random offset of the model from the centroid of the fragment, as a '
        'multiple of its longest side: what is seen is one side of the object', low=0.0, high=2.0)
    coarse_points: int = param(48, 'fragment points of the coarse ICP passes', low=6)
    coarse_reach: float = param(
        0.3, 'farthest pairs of the coarse passes, share of the longest side; the random start '
        'is about that far off', low=0.01, high=0.5)
    coarse_passes: int = param(20, 'most coarse passes, point to point', low=0)
    fine_reach: float = param(
        0.1, 'farthest pairs of the fine passes, share of the longest side: beyond it lie '
        'neighbours that share the region', low=0.01, high=0.5)
    fine_passes: int = param(20, 'most fine passes, point to plane', low=0)
    truncation_m: float = param(
        0.02, 'residuals above this count as this much: several times the noise of a Kinect, '
        'less than most objects', unit='m', low=0.001, high=0.2)
    score_points: int = param(256, 'model points that the score looks at', low=16)


def propose_fragments(observation, probabilities, models, config=FragmentConfig(), rng=None):
    """
    Propose the candidates of every category, at most `keep` each.

    :param observation: Observation; probabilities: PixelProbabilities of it.
    :param models: tuple of GenericModel, class id c is models[c - 1].
    :param rng: numpy Generator.
    :return: Candidates by category, best first; a category that no pixel shows has none.
    """
    rng = np.random.default_rng(0) if rng is None else rng
    scene = _Scene(observation, probabilities)
    pool = [Candidates.empty()]
    for c, model in enumerate(models, 1):
        p = probabilities.p[scene.kept, c]
        if p.any():
            pool.append(_category(scene, p, c, model, config, rng))
    return Candidates(*(np.concatenate([getattr(part, name) for part in pool]) for name in (
        'category', 'translation', 'rotation_xyzw', 'size', 'score')))


class _Scene:
    """What the kernels read: listed pixels as points, views and depths as flat arrays."""

    def __init__(self, observation, probabilities):
        views = observation.views
        self.first = np.cumsum([0] + [view.depth.size for view in views])[:-1].astype(np.int64)
        self.height = np.array([view.depth.shape[0] for view in views], np.int64)
        self.width = np.array([view.depth.shape[1] for view in views], np.int64)
        self.depth = np.concatenate([view.depth.ravel() for view in views]).astype(np.float32)
        self.K = np.stack([np.asarray(view.camera.K, np.float64) for view in views])
        self.T_camera_world = np.stack([inverse(view.camera.T_world_camera) for view in views])
        self.C = np.stack([view.camera.T_world_camera[:3, 3] for view in views])

        camera = probabilities.camera.astype(np.int64)
        u, v = probabilities.uv.astype(np.int64).T
        at = self.first[camera] + v * self.width[camera] + u
        self.kept = np.flatnonzero(np.isfinite(self.depth[at]))
        camera, u, v, at = camera[self.kept], u[self.kept], v[self.kept], at[self.kept]
        z = self.depth[at].astype(np.float64)
        K = self.K[camera]
        local = np.stack([(u - K[:, 0, 2]) / K[:, 0, 0] * z, (v - K[:, 1, 2]) / K[:, 1, 1] * z, z])
        T_world_camera = np.stack([view.camera.T_world_camera for view in views])[camera]
        self.points = (np.einsum('nij,jn->ni', T_world_camera[:, :3, :3], local)
                       + T_world_camera[:, :3, 3])
        self.row = np.full(len(self.depth), -1, np.int32)
        self.row[at] = np.arange(len(at))

    def views(self):
        """Return the arrays that describe the views, as every kernel takes them."""
        return self.first, self.width, self.height, self.K, self.T_camera_world


def _category(scene, p, c, model, config, rng):
    """Return the best candidates of one category; `p` (M,) uint8, not all zero."""
    m, cloud, longest = config.draws, model_cloud(model), model.longest_side
    drawn = rng.choice(len(p), m, p=p / p.sum(dtype=np.float64)).astype(np.int32)
    low, high = sorted((config.size_low, config.size_high))
    scale = np.exp(rng.uniform(np.log(low), np.log(high), m))
    R0 = Rotation.random(m, rng=rng).as_matrix()
    shift = rng.normal(size=(m, 3))
    shift *= (config.shift * longest * scale * rng.random(m) ** (1 / 3)
              / np.linalg.norm(shift, axis=1))[:, None]
    R, t, score = kernels.propose(
        drawn, config.region * longest * scale, p,
        np.maximum(np.ceil(config.likely * p[drawn]), 1).astype(np.uint8), scene.row,
        scene.points, rng.random(m), R0, shift, scale,
        np.array([config.coarse_reach, config.fine_reach]) * longest, config.coarse_points,
        np.array([config.coarse_passes, config.fine_passes]), config.most, config.fewest,
        config.truncation_m, max(1, len(cloud.points) // config.score_points), cloud.points,
        cloud.normals, cloud.grid, cloud.origin, cloud.cell, cloud.margin, cloud.graph,
        scene.depth, *scene.views(), scene.C)
    best = np.argsort(-score, kind='stable')[:config.keep]
    best = best[score[best] >= 0]
    size = (np.asarray(model.extents) * scale[best, None]).astype(np.float32)
    rotation = (Rotation.from_matrix(R[best]).as_quat(canonical=True) if len(best)
                else np.zeros((0, 4)))
    return Candidates(np.full(len(best), c, np.uint16), t[best], rotation, size,
                      score[best].astype(np.float32))

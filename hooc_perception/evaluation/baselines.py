# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Baselines: local features (FPFH) and point pair features (PPF), category by category.

Both register every generic model, at its own size, to the fused cloud of the objects on the
table, and take the best fits one after another. Nothing else in the package uses them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import itertools
from pathlib import Path
import time
from typing import Any, Protocol, TypeAlias

from hooc_perception.core.arrays import BoolArray, Float32Array, Float64Array
from hooc_perception.core.config import Config, param
from hooc_perception.core.geometry import back_project, pose_from_matrix, stage_rng
from hooc_perception.core.segment.observe import observe
from hooc_perception.core.segment.rectify import rectify
from hooc_perception.core.types import GenericModel, RectifiedView
from hooc_perception.errors import HoocError
from hooc_perception.evaluation.visibility import surface_samples
from hooc_perception.io.scenes.results import write_results
from hooc_perception.io.scenes.scene_set import SceneSet
import numpy as np
import open3d as o3d
from scipy.spatial import KDTree
from tqdm import tqdm

Cloud: TypeAlias = o3d.geometry.PointCloud
# Category, T_world_model (4, 4), share of explained model points.
Fit: TypeAlias = tuple[str, Float64Array, float]


@dataclass(frozen=True)
class BaselineConfig(Config):
    """Parameters of both baselines; customary values, chosen without looking at scores."""

    voxel_m: float = param(0.005, 'Voxel size to which both clouds are downsampled.', 'm', 0.001,
                           0.05)
    feature_radius: float = param(5.0, 'Radius of the features, in voxels.', '', 2.0, 20.0)
    pair_step: float = param(0.05, 'Steps of the point pair features and distance between the '
                             "points that they use, as a share of the model's diameter.", '',
                             0.01, 0.2)
    iterations: int = param(100000, 'RANSAC samples of three correspondences.', '', 100, 10000000)
    inlier_m: float = param(0.01, 'A model point this close to a scene point is explained.', 'm',
                            0.001, 0.05)
    min_fit: float = param(0.35, 'Minimum share of explained model points; half of a model faces '
                           'away from any one camera.', '', 0.0, 1.0)
    min_fresh: float = param(0.5, 'Minimum share of the scene points of a model that no better '
                             'one has taken.', '', 0.0, 1.0)


class Method(Protocol):
    """A way to find one model in a scene."""

    def model(self, cloud: Cloud) -> Any:
        """Return what `poses` needs of a model, whose cloud comes first."""
        ...

    def scene(self, cloud: Cloud) -> Any:
        """Return what `poses` needs of a scene."""
        ...

    def poses(self, model: Any, scene: Any) -> Sequence[Float64Array]:
        """Return candidate T_world_model, best first."""
        ...


def fused_cloud(views: Sequence[RectifiedView], voxel_m: float) -> Cloud:
    """Return an Open3D cloud, with normals, of the objects on the table."""
    cloud = o3d.geometry.PointCloud()
    for view in observe(views).views:
        part = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(
            back_project(view.depth, view.camera)[view.foreground]))
        part = part.voxel_down_sample(voxel_m)
        if not len(part.points):
            continue
        part.estimate_normals(o3d.geometry.KDTreeSearchParamHybrid(3 * voxel_m, 30))
        part.orient_normals_towards_camera_location(view.camera.T_world_camera[:3, 3])
        cloud += part
    return cloud.voxel_down_sample(voxel_m)


def model_cloud(model: GenericModel, voxel_m: float, rng: np.random.Generator,
                samples: int = 20000) -> Cloud:
    """Return an Open3D cloud, with normals, of a GenericModel's surface."""
    points, normals = surface_samples(model.vertices, model.faces, samples, rng)
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    cloud.normals = o3d.utility.Vector3dVector(normals)
    return cloud.voxel_down_sample(voxel_m)


class Fpfh:
    """FPFH features (Rusu et al. 2009), RANSAC over their correspondences."""

    def __init__(self, config: BaselineConfig, seed: int) -> None:
        self.config = config
        o3d.utility.random.seed(seed)

    def scene(self, cloud: Cloud) -> tuple[Cloud, Any]:
        """Return (cloud, features)."""
        radius = self.config.feature_radius * self.config.voxel_m
        # The stub has no default for `indices`.
        return cloud, o3d.pipelines.registration.compute_fpfh_feature(  # pyright: ignore[reportCallIssue]
            cloud, o3d.geometry.KDTreeSearchParamHybrid(radius, 100))

    def model(self, cloud: Cloud) -> tuple[Cloud, Any]:
        """Return (cloud, features): models and scenes are described alike."""
        return self.scene(cloud)

    def poses(self, model: tuple[Cloud, Any], scene: tuple[Cloud, Any]) -> list[Float64Array]:
        """Return the best T_world_model, [] where there is none."""
        registration = o3d.pipelines.registration
        reach = 1.5 * self.config.voxel_m
        found = registration.registration_ransac_based_on_feature_matching(
            model[0], scene[0], model[1], scene[1], True, reach,
            registration.TransformationEstimationPointToPoint(False), 3,
            [registration.CorrespondenceCheckerBasedOnEdgeLength(0.8),
             registration.CorrespondenceCheckerBasedOnDistance(reach)],
            registration.RANSACConvergenceCriteria(self.config.iterations, 0.999))
        return [found.transformation] if len(found.correspondence_set) else []


class Ppf:
    """Point pair features (Drost et al. 2010) as in OpenCV's surface_matching."""

    def __init__(self, config: BaselineConfig, seed: int) -> None:
        import cv2
        if not hasattr(cv2, 'ppf_match_3d_PPF3DDetector'):
            raise HoocError('the baseline ppf needs OpenCV with its surface_matching module; '
                            'install opencv-contrib-python-headless instead of '
                            'opencv-python-headless')
        self.cv2, self.config = cv2, config

    def model(self, cloud: Cloud) -> tuple[Cloud, Any, float]:
        """Return (cloud, trained detector, spacing of its points in metres)."""
        spacing = max(2 * self.config.voxel_m, self.config.pair_step * float(np.linalg.norm(
            cloud.get_max_bound() - cloud.get_min_bound())))
        # OpenCV downsamples again, by shares of the extents: finely enough to change nothing.
        detector = self.cv2.ppf_match_3d_PPF3DDetector(self.config.pair_step / 2,
                                                       self.config.pair_step)
        detector.trainModel(_oriented(cloud.voxel_down_sample(spacing)))
        return cloud, detector, spacing

    def scene(self, cloud: Cloud) -> tuple[Cloud]:
        """Return (cloud,): its downsampling depends on the model."""
        return (cloud,)

    def poses(self, model: tuple[Cloud, Any, float], scene: tuple[Cloud]) -> list[Float64Array]:
        """Return candidate T_world_model, best first."""
        _, detector, spacing = model
        points = _oriented(scene[0].voxel_down_sample(spacing))
        found = detector.match(points, 1 / 5, 0.5 * spacing / np.ptp(points[:, :3], axis=0).max())
        return [np.array(pose.pose) for pose in found[:5]]


def _oriented(cloud: Cloud) -> Float32Array:
    """Return (n, 6) float32 points and unit normals of an Open3D cloud."""
    cloud.normalize_normals()
    return np.ascontiguousarray(np.hstack([np.asarray(cloud.points),
                                           np.asarray(cloud.normals)]), np.float32)


METHODS: dict[str, type[Fpfh] | type[Ppf]] = {'fpfh': Fpfh, 'ppf': Ppf}


def run_baseline(name: str, scene_set: SceneSet, models: Mapping[str, GenericModel],
                 path: str | Path, seed: int = 0,
                 config: BaselineConfig = BaselineConfig()) -> None:
    """
    Write the results file of a baseline for all scenes of a set.

    :param name: 'fpfh' or 'ppf'.
    :param models: {category: GenericModel}; shape and extents are enough.
    :param path: results file to write.
    """
    method = METHODS[name](config, seed)
    rng = stage_rng(seed, 'baseline')
    prepared = {category: method.model(model_cloud(model, config.voxel_m, rng))
                for category, model in models.items()}
    entries = []
    for scene in tqdm(scene_set.scenes, desc=name, unit='scene', disable=None):
        views = scene.depth()
        start = time.perf_counter()
        found = find(method, [rectify(view) for view in views], prepared,
                     scene_set.max_instances, config)
        entries.append({'scene': scene.name, 'seconds': time.perf_counter() - start,
                        'energy': None, 'objects': [
                            _entry(category, T, fit, models[category])
                            for category, T, fit in found], **scene.world})
    write_results(path, scene_set.name, entries, profile=f'baseline {name}', seed=seed)


def find(method: Method, views: Sequence[RectifiedView], prepared: Mapping[str, Any],
         limit: int, config: BaselineConfig) -> list[Fit]:
    """
    Return [(category, T_world_model, share of explained model points)], the best fit first.

    A pass over all categories takes at most one object of each; where more are allowed, the next
    pass uses the remaining points, until a pass takes nothing.

    :param prepared: {category: what `method.model` made of its model}.
    :param limit: maximum number of instances per category, 0 = no limit.
    """
    cloud = fused_cloud(views, config.voxel_m)
    out: list[Fit] = []
    passes = itertools.count() if limit == 0 else range(limit)
    for _ in passes:
        if len(cloud.points) < 10:
            break
        with o3d.utility.VerbosityContextManager(o3d.utility.VerbosityLevel.Error):
            chosen, free = _pass(method, cloud, prepared, config)
        if not chosen:
            break
        out += chosen
        cloud = cloud.select_by_index(np.flatnonzero(free).tolist())
    return out


def _pass(method: Method, cloud: Cloud, prepared: Mapping[str, Any],
          config: BaselineConfig) -> tuple[list[Fit], BoolArray]:
    """Return (as `find`, at most one per category; (n,) bool, points that nothing took)."""
    scene, tree = method.scene(cloud), KDTree(np.asarray(cloud.points))
    fits = []
    for category, model in prepared.items():
        for T in method.poses(model, scene):
            T = o3d.pipelines.registration.registration_icp(
                model[0], cloud, config.inlier_m, T,
                o3d.pipelines.registration.TransformationEstimationPointToPlane()).transformation
            points = np.asarray(model[0].points) @ T[:3, :3].T + T[:3, 3]
            explained = tree.query(points, distance_upper_bound=config.inlier_m)[0] < np.inf
            if explained.mean() >= config.min_fit and np.isfinite(T).all():
                taken = np.unique(np.concatenate([
                    [], *tree.query_ball_point(points, config.inlier_m)]).astype(int))
                fits.append((float(explained.mean()), category, T, taken))
    free = np.ones(len(cloud.points), bool)
    out: dict[str, Fit] = {}
    # Large explained pieces first: a small model fits anywhere.
    for fit, category, T, taken in sorted(fits, key=lambda f: -f[0] * len(f[3])):
        if category not in out and free[taken].mean() >= config.min_fresh:
            out[category] = (category, T, fit)
            free[taken] = False
    return list(out.values()), free


def _entry(category: str, T_world_model: Float64Array, fit: float,
           model: GenericModel) -> dict[str, Any]:
    """Return the results entry of one found model."""
    translation, rotation = pose_from_matrix(T_world_model)
    return {'category': category, 'score': fit, 'translation': translation.tolist(),
            'rotation_xyzw': rotation.tolist(), 'size': model.extents.tolist()}

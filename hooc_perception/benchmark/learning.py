# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Contests of classification and alignment: forests and ICP."""

from typing import Any

from hooc_perception.benchmark.measure import Contest, Contestant
from hooc_perception.benchmark.scene import BenchScene
from hooc_perception.core.arrays import Float64Array
from hooc_perception.core.classification.forest import Forest
from hooc_perception.core.geometry import matrix_from_pose, stage_rng, transform
from hooc_perception.core.methods.icp import align, model_cloud
import numpy as np
import open3d as o3d
from scipy.spatial.transform import Rotation
from sklearn.ensemble import RandomForestClassifier

PIXELS, FEATURES, CLASSES, TREES, DEPTH = 20000, 60, 26, 5, 16
STARTS = 20


def forest_contest(seed: int = 0) -> Contest:
    """Return the Contest of predicting with the same trees, grown by scikit-learn."""
    rng = stage_rng(seed, 'bench/forest')
    x = rng.normal(size=(PIXELS, FEATURES)).astype(np.float32)
    y = (x[:, :8] @ rng.normal(size=(8, CLASSES)) + rng.gumbel(size=(PIXELS, CLASSES))).argmax(1)
    grown = RandomForestClassifier(TREES, max_depth=DEPTH, random_state=seed, n_jobs=1).fit(x, y)
    forest = converted(grown)
    return Contest('classify pixels',
                   f'{PIXELS} pixels, {FEATURES} features, {TREES} trees, {CLASSES} classes', (
                       Contestant('numba, lock-step (ours)', lambda: forest.predict(x)),
                       Contestant('scikit-learn', lambda: grown.predict_proba(x))),
                   # Our leaves hold probabilities in steps of 1 / 255.
                   lambda a, b: np.abs(a - b).max(), 0.01)


def converted(grown: RandomForestClassifier) -> Forest:
    """Return our Forest with the trees of a fitted scikit-learn forest."""
    columns, roots, base = [], [], 0
    for tree in (estimator.tree_ for estimator in grown.estimators_):
        roots.append(base)
        # Ours needs siblings next to each other: number breadth first, children in pairs.
        order, place = [0], {0: 0}
        for node in order:
            for child in (tree.children_left[node], tree.children_right[node]):
                if child >= 0:
                    place[child] = len(order)
                    order.append(child)
        leaf = tree.children_left[order] < 0
        columns.append((np.where(leaf, -1, tree.feature[order]), tree.threshold[order],
                        [0 if end else base + place[tree.children_left[node]]
                         for node, end in zip(order, leaf)], tree.value[order, 0]))
        base += len(order)
    feature, threshold, left, value = (np.concatenate(parts) for parts in zip(*columns))
    p = value / value.sum(axis=1, keepdims=True)
    # sklearn compares float32 features with float64 thresholds: round down to keep the result.
    low = threshold.astype(np.float32)
    low = np.where(low > threshold, np.nextafter(low, np.float32(-np.inf)), low)
    return Forest(feature.astype(np.int32), low.astype(np.float32), left.astype(np.int32),
                  np.array(roots, np.int32), np.arange(len(feature), dtype=np.int32),
                  np.round(255 * p).astype(np.uint8))


def icp_contest(scene: BenchScene, seed: int = 0) -> Contest:
    """Return the Contest of aligning a generic model's points to a fragment."""
    rng = stage_rng(seed, 'bench/icp')
    model = max(scene.models, key=lambda m: m.volume)
    points, normals = (np.asarray(a, np.float64)
                       for a in (model.surface_points, model.surface_normals))
    seen = normals[:, 0] + normals[:, 2] > 0
    fragment = points[seen] + rng.normal(0, 0.001, (int(seen.sum()), 3))
    starts = [matrix_from_pose(rng.normal(0, 0.01, 3),
                               Rotation.from_rotvec(rng.normal(0, 0.08, 3)).as_quat())
              for _ in range(STARTS)]
    reach, steps = 0.03, 30
    registration = o3d.pipelines.registration

    def ours() -> list[Float64Array]:
        target = model_cloud(model)
        return [align(target, fragment, T, reach, steps, plane=True).T_target_source
                for T in starts]

    def open3d() -> list[Any]:
        target = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
        target.normals = o3d.utility.Vector3dVector(normals)
        source = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(fragment))
        return [registration.registration_icp(
            source, target, reach, T, registration.TransformationEstimationPointToPlane(),
            registration.ICPConvergenceCriteria(1e-6, 1e-6, steps)).transformation
            for T in starts]

    def disagreement(a: list[Float64Array], b: list[Float64Array]) -> np.floating[Any]:
        # Median over the starts: at the maximum distance one may keep a pair that the other drops.
        return np.median([np.linalg.norm(transform(p, fragment) - transform(q, fragment),
                                         axis=1).max() for p, q in zip(a, b)])

    return Contest('align by ICP', f'{STARTS} starts, {len(fragment)} to {len(points)} points, '
                   'point to plane', (
                       Contestant('numba lattice (ours)', ours), Contestant('Open3D', open3d)),
                   disagreement, 0.002)

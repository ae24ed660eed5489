# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Rendered tables with boxes and cylinders, seen by fixed cameras: for tests of their poses."""

from dataclasses import replace

from hooc_perception.core.geometry import rays
from hooc_perception.core.render import render_depth
from hooc_perception.core.types import Camera, DepthView
import numpy as np
from scipy.spatial.transform import Rotation
import trimesh


def camera(name, azimuth_deg, distance=1.0, elevation_deg=40, width=320, height=240):
    """Return a Camera that looks at the origin."""
    a, e = np.radians([azimuth_deg, elevation_deg])
    forward = -np.array([np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)])
    right = np.cross(forward, [0, 0, 1.0])
    right /= np.linalg.norm(right)
    T = np.eye(4)
    T[:3] = np.column_stack([right, np.cross(forward, right), forward, -distance * forward])
    focal = 0.9 * width
    K = np.array([[focal, 0, (width - 1) / 2], [0, focal, (height - 1) / 2], [0, 0, 1]])
    return Camera(name, width, height, K, np.zeros(5), T)


def objects(seed, count=7):
    """Return meshes [(vertices, faces)] of boxes and cylinders that stand on the table."""
    rng, meshes = np.random.default_rng(seed), []
    for k in range(count):
        size = rng.uniform(0.05, 0.16, 3)
        mesh = (trimesh.creation.box(size) if k % 2 else
                trimesh.creation.cylinder(size[0] / 2, size[2], sections=48))
        angle = 2 * np.pi * k / count
        mesh.apply_transform(trimesh.transformations.rotation_matrix(rng.uniform(0, 6), [0, 0, 1]))
        mesh.apply_translation([0.22 * np.cos(angle), 0.22 * np.sin(angle), size[2] / 2])
        meshes.append((np.asarray(mesh.vertices, float), mesh.faces.astype(np.int32)))
    return meshes


def depth_of(seen_by, meshes, rng=None, noise_m=0.0015):
    """Return the (H, W) depth of the table with meshes on it, in whole millimetres; noisy."""
    depth = render_depth(meshes, seen_by)[0]
    T = seen_by.T_world_camera
    slope = rays(seen_by.K, seen_by.height, seen_by.width) @ T[2, :3]
    with np.errstate(divide='ignore'):
        table = np.where(slope < 0, -T[2, 3] / slope, np.inf)
    depth = np.minimum(depth, table)
    if rng is not None:
        depth = depth + rng.normal(0, noise_m, depth.shape)
    depth = np.round(1000 * depth) / 1000
    return np.where(depth < 4, depth, np.nan).astype(np.float32)


def disturbed(posed, rng, turn_deg=5.0, shift_m=0.05):
    """Return a Camera with a wrong pose: turned about itself and shifted by so much."""
    axis, way = rng.normal(size=(2, 3))
    T = posed.T_world_camera.copy()
    T[:3, :3] = Rotation.from_rotvec(np.radians(turn_deg) * axis / np.linalg.norm(axis)
                                     ).as_matrix() @ T[:3, :3]
    T[:3, 3] += shift_m * way / np.linalg.norm(way)
    return replace(posed, T_world_camera=T)


def scenes(true, stated, seeds, count=7, noise_m=0.0015):
    """
    Return frame sets, per seed one tuple of DepthViews.

    :param true: the Cameras that see; `stated`: the Cameras that their views name.
    """
    return [tuple(DepthView(said, depth_of(sees, objects(seed, count),
                                           np.random.default_rng([seed, k]), noise_m))
                  for k, (sees, said) in enumerate(zip(true, stated))) for seed in seeds]


def pose_error(T_true, T):
    """Return (mm, degrees) between two (4, 4) poses."""
    D = np.linalg.inv(T_true) @ T
    cosine = np.clip((np.trace(D[:3, :3]) - 1) / 2, -1, 1)
    return 1000 * float(np.linalg.norm(D[:3, 3])), float(np.degrees(np.arccos(cosine)))

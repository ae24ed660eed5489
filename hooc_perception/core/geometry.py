# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Rigid transforms and pinhole projection. `T_a_b` maps points of frame b into frame a."""

from collections.abc import Sequence
import zlib

from hooc_perception.core.arrays import AnyArray, Float32Array, Float64Array, Int32Array
from hooc_perception.core.types import Camera, Candidates, GenericModel
from hooc_perception.errors import HoocError
import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation


def matrix_from_pose(translation: npt.ArrayLike, rotation_xyzw: npt.ArrayLike) -> Float64Array:
    """Return T_a_b (4, 4) from a translation (3,) in metres and a quaternion (4,) xyzw."""
    T_a_b = np.eye(4)
    T_a_b[:3, :3] = Rotation.from_quat(rotation_xyzw).as_matrix()
    T_a_b[:3, 3] = translation
    return T_a_b


def pose_from_matrix(T_a_b: Float64Array) -> tuple[Float64Array, Float64Array]:
    """Return (translation (3,), rotation_xyzw (4,) with w >= 0) of a (4, 4) transform."""
    return T_a_b[:3, 3].copy(), Rotation.from_matrix(T_a_b[:3, :3]).as_quat(canonical=True)


def canonical_pose(T_a_b: Float64Array) -> Float64Array:
    """
    Return the (4, 4) transform next to T_a_b that survives a trip through a quaternion.

    Matrix -> quaternion -> matrix changes the last bits. Here the quaternion, scaled so that
    its largest component is 1, is rounded to 2^-30 (1e-9 rad), far more than such a trip
    changes: before and after it, the result is the same to the last bit. Processes that hand
    on poses as quaternions and those that keep the matrix therefore agree.
    """
    q = Rotation.from_matrix(T_a_b[:3, :3]).as_quat()
    q = np.round(q / q[np.argmax(np.abs(q))] * 2.0 ** 30) / 2.0 ** 30
    # Of equal components the first one decides on the sign; adding 0 turns -0 into 0.
    return matrix_from_pose(T_a_b[:3, 3], q * q[np.argmax(np.abs(q))] + 0.0)


def inverse(T_a_b: Float64Array) -> Float64Array:
    """Return T_b_a of a rigid (4, 4) transform."""
    T_b_a = np.eye(4)
    T_b_a[:3, :3] = T_a_b[:3, :3].T
    T_b_a[:3, 3] = -T_a_b[:3, :3].T @ T_a_b[:3, 3]
    return T_b_a


def transform(T_a_b: Float64Array, points_b: AnyArray) -> Float64Array:
    """Return points (n, 3) of frame b in frame a."""
    return points_b @ T_a_b[:3, :3].T + T_a_b[:3, 3]


def project(K: Float64Array, points_camera: Float64Array) -> tuple[Float64Array, Float64Array]:
    """Return (u, v) float arrays (n,) of points (n, 3) in the optical frame, z > 0."""
    z = points_camera[:, 2]
    return (K[0, 0] * points_camera[:, 0] / z + K[0, 2],
            K[1, 1] * points_camera[:, 1] / z + K[1, 2])


def rays(K: Float64Array, height: int, width: int) -> Float64Array:
    """Return (H, W, 3) float64 directions with z = 1 through the pixel centres."""
    u, v = np.meshgrid(np.arange(width), np.arange(height))
    return np.stack([(u - K[0, 2]) / K[0, 0], (v - K[1, 2]) / K[1, 1], np.ones(u.shape)], -1)


def back_project(depth: Float32Array, camera: Camera) -> Float64Array:
    """Return (H, W, 3) float64 world points of a rectified (H, W) depth image; NaN stays."""
    points = rays(camera.K, *depth.shape) * depth[..., None]
    return transform(camera.T_world_camera, points)


def posed_vertices(model: GenericModel, translation: npt.ArrayLike,
                   rotation_xyzw: npt.ArrayLike, size: npt.ArrayLike) -> Float64Array:
    """Return (V, 3) world vertices of a GenericModel scaled to `size` and posed."""
    scaled = model.vertices * (np.asarray(size, np.float64) / np.maximum(model.extents, 1e-9))
    return transform(matrix_from_pose(translation, rotation_xyzw), scaled)


def posed_meshes(objects: Candidates, models: Sequence[GenericModel]
                 ) -> list[tuple[Float64Array, Int32Array]]:
    """
    Return (vertices (V, 3) world, metres; faces (F, 3)) of each object, in place.

    :param models: class id c is models[c - 1].
    """
    return [(posed_vertices(model, objects.translation[k], objects.rotation_xyzw[k],
                            objects.size[k]), model.faces)
            for k, model in enumerate(objects.shapes(models))]


def stage_rng(seed: int, stage: str, *keys: int) -> np.random.Generator:
    """
    Return the numpy Generator of one stage, independent of what other stages drew.

    Separate processes that know the seed and the stage's name draw the same numbers, so the
    nodes and the one-process chain agree.

    :raises HoocError: where the seed is negative.
    """
    if seed < 0:
        raise HoocError(f'the seed is {seed}; give 0 or a positive number')
    return np.random.default_rng([int(seed), zlib.crc32(stage.encode()), *map(int, keys)])

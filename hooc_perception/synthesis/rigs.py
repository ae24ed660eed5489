# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Camera rigs around a table: random, or a given rig with small changes."""

from collections.abc import Sequence
from dataclasses import dataclass

from hooc_perception.core.arrays import Float64Array
from hooc_perception.core.types import Camera
from hooc_perception.synthesis.sensor import miscalibrated
import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation


@dataclass(frozen=True)
class RingShape:
    """
    Ranges of the places of cameras around a table.

    :ivar elevation: above the horizon, radians.
    :ivar distance: from the origin, metres.
    :ivar jitter: largest deviation of a camera from an even spread, as a share of the gap to the
        next.
    """

    elevation: tuple[float, float] = (0.45, 0.95)
    distance: tuple[float, float] = (0.95, 1.45)
    jitter: float = 0.2


def look_at(position: Float64Array, target: npt.ArrayLike) -> Float64Array:
    """Return T_world_camera (4, 4) of an optical frame at `position` that faces `target`."""
    forward = np.asarray(target, float) - position
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    if np.linalg.norm(right) < 1e-6:
        right = np.array([1.0, 0.0, 0.0])
    right /= np.linalg.norm(right)
    T = np.eye(4)
    T[:3, :3] = np.stack([right, np.cross(forward, right), forward], axis=1)
    T[:3, 3] = position
    return T


def undistorted(camera: Camera) -> Camera:
    """Return the camera without lens distortion and skew, as in a rectified view."""
    K = np.array(camera.K, float)
    K[0, 1] = 0
    return Camera(camera.name, camera.width, camera.height, K,
                  np.zeros(5), np.array(camera.T_world_camera, float))


def ring(rng: np.random.Generator, count: int, width: int = 512, height: int = 424,
         focal: float = 366.0, shape: RingShape = RingShape(),
         prefix: str = 'camera') -> tuple[Camera, ...]:
    """
    Return `count` cameras around the origin, roughly evenly spread and slightly tilted.

    :param width: of the images, pixels; `height` likewise.
    :param focal: focal length, pixels.
    :param prefix: of the names, which end in 1, 2, ...
    """
    start = rng.uniform(-np.pi, np.pi)
    cameras = []
    for i in range(count):
        azimuth = start + 2 * np.pi * (i + rng.uniform(-shape.jitter, shape.jitter)) / count
        lift, far = rng.uniform(*shape.elevation), rng.uniform(*shape.distance)
        position = far * np.array([np.cos(azimuth) * np.cos(lift),
                                   np.sin(azimuth) * np.cos(lift), np.sin(lift)])
        T = look_at(position, [*rng.uniform(-0.06, 0.06, 2), 0.03])
        T[:3, :3] = T[:3, :3] @ Rotation.from_rotvec([0, 0, rng.normal(0, 0.02)]).as_matrix()
        K = np.array([[focal, 0, 0.5 * (width - 1)], [0, focal, 0.5 * (height - 1)], [0, 0, 1]])
        K[:2, 2] += rng.normal(0, 3.0, 2)
        cameras.append(Camera(f'{prefix}{i + 1}', width, height, K, np.zeros(5), T))
    return tuple(cameras)


def random_rig(cameras: Sequence[Camera], rng: np.random.Generator, low: int = 1,
               high: int = 4) -> tuple[Camera, ...]:
    """
    Return a rig of `low` to `high` cameras with other poses and lenses than the given ones.

    Image size and focal length stay near those of the given cameras, so that a pixel keeps
    its scale.
    """
    like = cameras[int(rng.integers(len(cameras)))]
    count = int(rng.integers(low, high + 1))
    focal = float(np.mean([c.K[0, 0] for c in cameras])) * np.exp(rng.normal(0, 0.1))
    return ring(rng, count, like.width, like.height, focal)


def jittered_rig(cameras: Sequence[Camera], rng: np.random.Generator, rotation_rad: float = 0.03,
                 translation_m: float = 0.03) -> tuple[Camera, ...]:
    """Return the given cameras with slightly changed poses, as if the rig was set up again."""
    return tuple(miscalibrated(undistorted(c), rng, rotation_rad, translation_m)
                 for c in cameras)

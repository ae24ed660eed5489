# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Camera rigs around a table: drawn at random, or a given rig moved a little."""

from hooc_perception.core.types import Camera
from hooc_perception.synthesis.sensor import miscalibrated
import numpy as np
from scipy.spatial.transform import Rotation


def look_at(position, target):
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


def undistorted(camera):
    """Return the camera without lens distortion and skew, as a rectified view has it."""
    K = np.array(camera.K, float)
    K[0, 1] = 0
    return Camera(camera.name, camera.width, camera.height, K,
                  np.zeros(5), np.array(camera.T_world_camera, float))


def ring(rng, count, width=512, height=424, focal=366.0, elevation=(0.45, 0.95),
         distance=(0.95, 1.45), jitter=0.2, names=None):
    """
    Return `count` cameras around the origin, roughly evenly spread and a little askew.

    :param elevation: range above the horizon, radians; `distance`: range, metres.
    :param jitter: half the range of a camera's place on the ring, as a share of the gap to
        the next.
    """
    start = rng.uniform(-np.pi, np.pi)
    cameras = []
    for i in range(count):
        azimuth = start + 2 * np.pi * (i + rng.uniform(-jitter, jitter)) / count
        lift, far = rng.uniform(*elevation), rng.uniform(*distance)
        position = far * np.array([np.cos(azimuth) * np.cos(lift),
                                   np.sin(azimuth) * np.cos(lift), np.sin(lift)])
        T = look_at(position, [*rng.uniform(-0.06, 0.06, 2), 0.03])
        T[:3, :3] = T[:3, :3] @ Rotation.from_rotvec([0, 0, rng.normal(0, 0.02)]).as_matrix()
        K = np.array([[focal, 0, 0.5 * (width - 1)], [0, focal, 0.5 * (height - 1)], [0, 0, 1]])
        K[:2, 2] += rng.normal(0, 3.0, 2)
        name = names[i] if names else f'camera{i + 1}'
        cameras.append(Camera(name, width, height, K, np.zeros(5), T))
    return tuple(cameras)


def random_rig(cameras, rng, low=1, high=4):
    """
    Return a rig of `low` to `high` cameras, unlike the given ones in place and lens.

    Image size and focal length stay near those of the given cameras, so that a pixel keeps
    its scale.
    """
    like = cameras[rng.integers(len(cameras))]
    count = int(rng.integers(low, high + 1))
    focal = float(np.mean([c.K[0, 0] for c in cameras])) * np.exp(rng.normal(0, 0.1))
    return ring(rng, count, like.width, like.height, focal)


def jittered_rig(cameras, rng, rotation_rad=0.03, translation_m=0.03):
    """Return the given cameras, each moved a little: a rig that was set up once more."""
    return tuple(miscalibrated(undistorted(c), rng, rotation_rad, translation_m)
                 for c in cameras)

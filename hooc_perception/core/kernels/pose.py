# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
The layout of a hypothesis, and what is done with its pose and size.

A hypothesis is a row of WIDTH numbers: translation (metres, world), rotation as a quaternion
xyzw, and the scale along each axis of the generic model. Tables of scored hypotheses have one
more column, SCORE.
"""

from typing import NamedTuple

from hooc_perception.core.arrays import Float64Array
import numba as nb
import numpy as np

# Columns of a hypothesis; numba takes them for compile-time constants.
TX, TY, TZ, QX, QY, QZ, QW, SX, SY, SZ = range(10)
WIDTH = 10
SCORE = WIDTH
# The same as slices, for numpy.
TRANSLATION, QUATERNION, SCALE = slice(0, 3), slice(3, 7), slice(7, 10)
# Least and greatest scale of a hypothesis along an axis.
SCALE_LIMITS = (0.45, 2.0)
# Length of random steps, in step sizes: its limits, and the factor after a success.
LENGTH_LIMITS = (0.05, 2.0)
LENGTHEN = 1.3


class StepSizes(NamedTuple):
    """
    Standard deviations of a random step of unit length.

    :ivar translation: metres, along each axis.
    :ivar rotation: radians, about each axis.
    :ivar log_scale: natural logarithm of the factor along each axis of the model.
    """

    translation: float
    rotation: float
    log_scale: float


@nb.njit(cache=True, inline='always')
def quaternion_multiply(a: Float64Array, b: Float64Array, out: Float64Array) -> None:
    """Write the normalized quaternion product a * b (xyzw) into out (4,), which may be a or b."""
    x = a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1]
    y = a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0]
    z = a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3]
    w = a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2]
    s = 1.0 / np.sqrt(x * x + y * y + z * z + w * w)
    out[0], out[1], out[2], out[3] = x * s, y * s, z * s, w * s


@nb.njit(cache=True, inline='always')
def rotation_of(h: Float64Array, R: Float64Array) -> None:
    """Write the rotation matrix R_world_model of hypothesis `h` into R (3, 3)."""
    x, y, z, w = h[QX], h[QY], h[QZ], h[QW]
    R[0, 0], R[0, 1], R[0, 2] = 1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)
    R[1, 0], R[1, 1], R[1, 2] = 2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)
    R[2, 0], R[2, 1], R[2, 2] = 2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)


@nb.njit(cache=True, inline='always')
def posed(h: Float64Array, vertices: Float64Array, out: Float64Array) -> None:
    """Write the world positions of model vertices (V, 3) under hypothesis `h` into out (V, 3)."""
    R = np.empty((3, 3))
    rotation_of(h, R)
    for i in range(vertices.shape[0]):
        x, y, z = vertices[i, 0] * h[SX], vertices[i, 1] * h[SY], vertices[i, 2] * h[SZ]
        for k in range(3):
            out[i, k] = R[k, 0] * x + R[k, 1] * y + R[k, 2] * z + h[TX + k]


@nb.njit(cache=True, inline='always')
def squared_log_scale(h: Float64Array) -> float:
    """Return |log scale|^2 of hypothesis `h`, which the priors on its size are made of."""
    a, b, c = np.log(h[SX]), np.log(h[SY]), np.log(h[SZ])
    return a * a + b * b + c * c


@nb.njit(cache=True)
def random_step(sizes: StepSizes, length: float, yaw: float, q: Float64Array,
                trial: Float64Array) -> None:
    """
    Move hypothesis `trial` (10,) at random, in place: translation, rotation, scale or several.

    :param length: factor on all step sizes.
    :param yaw: further factor on the rotation about the vertical.
    :param q: (4,) float64 scratch.
    """
    part = np.random.random()
    if part < 0.75:
        for k in range(3):
            trial[TX + k] += np.random.normal() * sizes.translation * length
    if part > 0.4:
        q[0] = np.random.normal() * sizes.rotation * length / 2
        q[1] = np.random.normal() * sizes.rotation * length / 2
        q[2] = np.random.normal() * sizes.rotation * length / 2 * yaw
        q[3] = 1.0
        quaternion_multiply(q, trial[QX:QW + 1], trial[QX:QW + 1])
    if part > 0.6 or part < 0.2:
        for k in range(3):
            factor = np.exp(np.random.normal() * sizes.log_scale * length)
            trial[SX + k] = min(SCALE_LIMITS[1], max(SCALE_LIMITS[0], trial[SX + k] * factor))


@nb.njit(cache=True, inline='always')
def adapted_length(length: float, success: bool, shorten: float) -> float:
    """Return the length of the next random step; `shorten` is the factor after a failure."""
    if success:
        return min(LENGTH_LIMITS[1], length * LENGTHEN)
    return max(LENGTH_LIMITS[0], length * shorten)

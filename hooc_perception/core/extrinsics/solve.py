# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Gauss-Newton steps on the poses of cameras, and what of them the surfaces determine.

A pose changes by a twist (v, w) in the world: a point p of the camera moves by v + w x (p - c),
where c is the camera's position. A point-to-plane distance n . (p_i - p_j) therefore has the
derivative (n, (p - c_i) x n) for camera i and the negative one, about c_j, for camera j (Chen &
Medioni 1992; Neugebauer 1997 for many views at once).
"""

from collections.abc import Sequence

from hooc_perception.core.arrays import AnyArray, BoolArray, Float64Array
from hooc_perception.core.extrinsics.surface import Matches
import numpy as np
from scipy.spatial.transform import Rotation

# Residuals are never believed to scatter by less than this.
LEAST_SCALE_M = 0.002
# Share of the diagonal that is added to it, so that what nothing determines stays put.
DAMPING = 1e-6
# A turn counts by how far it moves a point at this distance from the middle.
LEVER_M = 0.1
# A direction is determined if the squared components of the normals along it sum up to this,
# and to this share of the points: noise of the normals gives a few thousandths.
LEAST_INFORMATION, LEAST_SHARE = 30.0, 0.02


class Normal:
    """
    The normal equations of all cameras at once.

    :param centres: (N, 3) float64 positions of the cameras, world.
    """

    def __init__(self, centres: Float64Array) -> None:
        """Start without any equation."""
        self._centres = centres
        self._H = np.zeros((6 * len(centres), 6 * len(centres)))
        self._g = np.zeros(6 * len(centres))

    def add(self, points: Float64Array, normals: Float64Array, residual_m: Float64Array,
            camera: int, other: int | None = None) -> None:
        """
        Add equations n . (p_camera - p_other) = 0; without `other`, towards a fixed plane.

        Each counts by the Geman-McClure weight of its residual, whose scale is the spread of
        all of them.
        """
        if not len(points):
            return
        scale = max(1.4826 * float(np.median(np.abs(residual_m))), LEAST_SCALE_M)
        weight = 1.0 / (1.0 + (residual_m / (2 * scale)) ** 2) ** 2
        rows = [(camera, self._derivative(points, normals, camera))]
        if other is not None:
            rows.append((other, -self._derivative(points, normals, other)))
        for i, J_i in rows:
            weighted = (J_i * weight[:, None]).T
            self._g[6 * i:6 * i + 6] += weighted @ residual_m
            for j, J_j in rows:
                self._H[6 * i:6 * i + 6, 6 * j:6 * j + 6] += weighted @ J_j

    def step(self, free: BoolArray) -> Float64Array:
        """
        Return the twists (N, 6) that solve the equations.

        :param free: (N, 6) bool, what may change; the rest stays.
        """
        index = np.flatnonzero(free.ravel())
        H = self._H[np.ix_(index, index)]
        damping = DAMPING * (np.diag(H) + 1.0)
        twists = np.zeros(free.size)
        twists[index] = -np.linalg.solve(H + np.diag(damping), self._g[index])
        return twists.reshape(free.shape)

    def _derivative(self, points: Float64Array, normals: Float64Array,
                    camera: int) -> Float64Array:
        turning: AnyArray = np.cross(points - self._centres[camera], normals)
        return np.hstack([normals, turning.astype(np.float64)])


def moved(T_world_camera: Float64Array, twist: Float64Array) -> Float64Array:
    """Return a pose (4, 4) after a twist (6,): shift in metres, rotation vector at the camera."""
    T = T_world_camera.copy()
    T[:3, :3] = Rotation.from_rotvec(twist[3:]).as_matrix() @ T[:3, :3]
    T[:3, 3] += twist[:3]
    return T


def open_motions(cameras: int, found: Sequence[tuple[int, int, Matches]]) -> Float64Array:
    """
    Return how the cameras can move on the table without the sloping surfaces changing.

    Height, roll and pitch of a camera follow from the table. What is left is its place (x, y)
    and its turn about the vertical; a plane lets it slide and turn freely, a cylinder lets it
    turn.

    :param cameras: their number; the first one is held.
    :param found: (camera, other, Matches) of every compared pair.
    :return: (k, N, 3) motions (x, y, turn times LEVER_M) of length 1; k = 0 where the surfaces
        determine everything.
    """
    pairs = [(i, j, m.points[m.sloping], m.normals[m.sloping]) for i, j, m in found]
    points = np.concatenate([np.zeros((0, 3)), *(p for _, _, p, _ in pairs)])
    middle = points.mean(axis=0) if len(points) else np.zeros(3)
    H = np.zeros((3 * cameras, 3 * cameras))
    for i, j, p, n in pairs:
        away = p - middle
        turn = (away[:, 0] * n[:, 1] - away[:, 1] * n[:, 0]) / LEVER_M
        J = np.column_stack([n[:, 0], n[:, 1], turn])
        block = J.T @ J
        for a, b, sign in ((i, i, 1), (j, j, 1), (i, j, -1), (j, i, -1)):
            H[3 * a:3 * a + 3, 3 * b:3 * b + 3] += sign * block
    if cameras < 2:
        return np.zeros((0, cameras, 3))
    values, vectors = np.linalg.eigh(H[3:, 3:])
    weak = values < max(LEAST_INFORMATION, LEAST_SHARE * len(points))
    motions = np.zeros((int(weak.sum()), cameras, 3))
    motions[:, 1:] = vectors[:, weak].T.reshape(-1, cameras - 1, 3)
    return motions

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The surroundings of the objects: a table of finite size, a floor and the walls of a room."""

from dataclasses import dataclass

from hooc_perception.core.arrays import Float64Array, Int32Array
from hooc_perception.core.config import Config, param
import numpy as np


@dataclass(frozen=True)
class RoomConfig(Config):
    """Ranges from which the table and the room are drawn; lengths in metres."""

    table_low: float = param(1.2, 'Shortest side of the table.', 'm', 0.3, 20.0)
    table_high: float = param(1.8, 'Longest side of the table.', 'm', 0.3, 20.0)
    offset: float = param(0.1, "Standard deviation of the table's centre from the world's "
                          'origin, along each axis.', 'm', 0.0, 5.0)
    empty: float = param(0.15, 'Share of scenes with nothing around the table.', '', 0.0, 1.0)


@dataclass(frozen=True)
class Room:
    """
    A random table and room.

    :ivar sides: (2,) of the table, metres; `centre` (2,) world; `yaw` radians.
    :ivar floor: height of the floor, metres, negative; NaN without a floor.
    :ivar walls: (4,) distances of the walls -x, +x, -y, +y from the origin, metres.
    """

    sides: Float64Array
    centre: Float64Array
    yaw: float
    floor: float
    walls: Float64Array

    def meshes(self) -> list[tuple[Float64Array, Int32Array]]:
        """Return [(vertices (V, 3) float64 world, faces (F, 3) int32), ...], finely tiled."""
        turn = np.array([[np.cos(self.yaw), np.sin(self.yaw), 0],
                         [-np.sin(self.yaw), np.cos(self.yaw), 0]])
        ex, ey = self.sides[0] * turn[0], self.sides[1] * turn[1]
        corner = np.array([*self.centre, 0.0]) - 0.5 * (ex + ey)
        thick = np.array([0, 0, -0.035])
        quads = [(corner, ex, ey, 0.15), (corner, ex, thick, 0.15), (corner, ey, thick, 0.15),
                 (corner + ex, ey, thick, 0.15), (corner + ey, ex, thick, 0.15)]
        if np.isfinite(self.floor):
            low = np.array([-self.walls[0], -self.walls[2], self.floor])
            high = np.array([self.walls[1], self.walls[3], self.floor])
            x, y = np.array([high[0] - low[0], 0, 0]), np.array([0, high[1] - low[1], 0])
            z = np.array([0, 0, 2.6])
            quads += [(low, x, y, 0.4), (low, x, z, 0.4), (low, y, z, 0.4),
                      (low + x, y, z, 0.4), (low + y, x, z, 0.4)]
        return [tiled_quad(*quad) for quad in quads]


def draw_room(rng: np.random.Generator, config: RoomConfig = RoomConfig()) -> Room:
    """Return a random Room."""
    sides = rng.uniform(config.table_low, config.table_high, 2)
    floor = np.nan if rng.random() < config.empty else -rng.uniform(0.6, 1.0)
    return Room(sides, config.offset * rng.standard_normal(2), rng.uniform(-np.pi, np.pi),
                floor, rng.uniform(1.6, 4.0, 4))


def tiled_quad(corner: Float64Array, edge_a: Float64Array, edge_b: Float64Array,
               step: float) -> tuple[Float64Array, Int32Array]:
    """
    Return (vertices, faces) of a parallelogram cut into tiles of about `step` metres.

    Tiled, because the renderer skips triangles that reach behind the camera.
    """
    na = max(1, int(np.ceil(np.linalg.norm(edge_a) / step)))
    nb = max(1, int(np.ceil(np.linalg.norm(edge_b) / step)))
    a, b = np.meshgrid(np.linspace(0, 1, na + 1), np.linspace(0, 1, nb + 1), indexing='ij')
    vertices = corner + a.reshape(-1, 1) * edge_a + b.reshape(-1, 1) * edge_b
    i = (np.arange(na)[:, None] * (nb + 1) + np.arange(nb)).ravel()
    faces = np.concatenate([np.stack([i, i + nb + 1, i + 1], 1),
                            np.stack([i + 1, i + nb + 1, i + nb + 2], 1)])
    return vertices, faces.astype(np.int32)

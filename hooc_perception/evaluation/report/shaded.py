# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Shaded pictures of posed objects on a part of the table."""

from collections.abc import Sequence

from hooc_perception.core.arrays import AnyArray, Float64Array, Int32Array, UInt8Array
from hooc_perception.core.types import Camera
from hooc_perception.evaluation.report.pictures import RGB
from hooc_perception.objects.shaded import Orbit, render_shaded
import numpy as np

TABLE_RGB = (214, 207, 194)
BACKGROUND = (236, 239, 243)
ELEVATION_DEG = 42.0
BORDER_M = 0.05


def table_mesh(meshes: Sequence[tuple[AnyArray, AnyArray]],
               cells: int = 24) -> tuple[Float64Array, Int32Array]:
    """Return (vertices, faces) of the table top below all meshes, with a border; z = 0."""
    points = np.concatenate([v for v, _ in meshes])
    low, high = points.min(0)[:2] - BORDER_M, points.max(0)[:2] + BORDER_M
    # Several cells: shading is computed at corners, and large triangles would look flat.
    x, y = (np.linspace(a, b, cells + 1) for a, b in zip(low, high))
    grid = np.stack([*np.meshgrid(x, y, indexing='ij'), np.full((cells + 1,) * 2, -0.001)], -1)
    corner = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    faces = np.concatenate([np.stack([corner, corner + cells + 1, corner + cells + 2], 1),
                            np.stack([corner, corner + cells + 2, corner + 1], 1)])
    return grid.reshape(-1, 3), faces.astype(np.int32)


def shaded_picture(meshes: Sequence[tuple[AnyArray, AnyArray]], colours: Sequence[RGB],
                   camera: Camera, framed: Sequence[tuple[AnyArray, AnyArray]],
                   size: tuple[int, int] = (640, 440)) -> UInt8Array:
    """
    Return (h, w, 3) uint8: meshes in their colours on the table, seen from `camera`.

    :param meshes: sequence of (vertices (V, 3) world metres, faces (F, 3)).
    :param colours: one (r, g, b) 0..255 per mesh.
    :param framed: the meshes that determine the frame, so that two pictures can be compared.
    """
    if not framed:
        return np.full((size[1], size[0], 3), BACKGROUND, np.uint8)
    table = table_mesh(framed)
    middle = (table[0].min(0) + table[0].max(0)) / 2
    eye = camera.T_world_camera[:3, 3] - middle
    view = Orbit(float(np.degrees(np.arctan2(eye[1], eye[0]))), ELEVATION_DEG, 0.97).camera(
        np.concatenate([table[0], *(v for v, _ in framed)]), size)
    return render_shaded([table, *meshes], view, size, [TABLE_RGB, *colours], BACKGROUND)

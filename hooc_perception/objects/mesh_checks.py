# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Whether a mesh can be an object on a table: its size, and parts far away from the rest."""

import math

from hooc_perception.core.arrays import BoolArray, Float64Array
import numpy as np
import trimesh

# Longest sides of objects on a table of 1.6 m: from a small nut to a long tray.
SHORTEST_M, LONGEST_M = 0.005, 1.2
# The middle of what is common, to choose between units.
TYPICAL_M = 0.13
UNITS = (('millimetres', 0.001), ('centimetres', 0.01), ('inches', 0.0254), ('metres', 1.0))
COMMON_M = (0.02, 0.6)
# A part is stray if it is small, farther from the rest than FAR sides of it, and so few parts
# are that the mesh is no soup.
STRAY_AREA, FAR, MAX_PARTS = 0.1, 0.5, 1000


def size_trouble(longest_m: float, scale: float) -> str | None:
    """
    Check that a mesh has the size of an object on a table.

    :param longest_m: longest side of its bounding box as scaled, metres.
    :param scale: metres per unit by which it was scaled.
    :return: None, or words that follow "mesh FILE is" and end with the scale to write.
    """
    if SHORTEST_M <= longest_m <= LONGEST_M:
        return None
    raw = longest_m / scale
    likely = sorted(((name, unit) for name, unit in UNITS
                     if COMMON_M[0] <= raw * unit <= COMMON_M[1]),
                    key=lambda row: abs(math.log(raw * row[1] / TYPICAL_M)))
    size = f'{longest_m:.3g} m' if longest_m >= 0.01 else f'{1000 * longest_m:.3g} mm'
    is_so = (f'{size} long with scale {scale:g}, which nothing on a table is (from '
             f'{1000 * SHORTEST_M:g} mm to {LONGEST_M:g} m)')
    if not likely:
        return f'{is_so}; set scale to the metres of one unit (0.001 for millimetres)'
    (name, unit), *others = likely
    more = ''.join(f'; or scale: {u:g} if it is in {n} ({100 * raw * u:.2g} cm)'
                   for n, u in others[:1])
    return (f'{is_so}; it seems to be in {name} ({100 * raw * unit:.2g} cm long), so write '
            f'scale: {unit:g} for it in dataset.yaml{more}')


def stray_parts(mesh: trimesh.Trimesh) -> tuple[BoolArray, Float64Array] | None:
    """
    Find small parts of a mesh that lie far away from the rest.

    :param mesh: merged, so that the faces of a part share vertices.
    :return: None without any; else (faces that are stray (F,) bool, extents (3,) of the rest).
    """
    labels = trimesh.graph.connected_component_labels(mesh.edges, len(mesh.vertices))
    labels = np.unique(labels[mesh.faces[:, 0]], return_inverse=True)[1]
    count = int(labels.max()) + 1
    if not 1 < count <= MAX_PARTS:
        return None
    area = np.bincount(labels, mesh.area_faces, count)
    corners = mesh.triangles
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low, labels, corners.min(axis=1))
    np.maximum.at(high, labels, corners.max(axis=1))
    main = np.arange(count) == area.argmax()
    while True:
        inner, outer = low[main].min(axis=0), high[main].max(axis=0)
        gap = np.linalg.norm(np.maximum(0, np.maximum(low - outer, inner - high)), axis=1)
        joined = main | (gap <= FAR * (outer - inner).max())
        if (joined == main).all():
            break
        main = joined
    if main.all() or area[~main].sum() > STRAY_AREA * area.sum():
        return None
    return ~main[labels], outer - inner

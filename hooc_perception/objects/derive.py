# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Derive everything that the pipeline needs to know about a category from its mesh, once."""

from hooc_perception.core.arrays import AnyArray, Float64Array, Int64Array
from hooc_perception.core.types import GenericModel
from hooc_perception.objects.manifold import from_manifold, to_manifold
from hooc_perception.objects.repair import closed
from hooc_perception.objects.rest import resting_poses
from hooc_perception.objects.symmetry import axis_symmetry
import numpy as np
import trimesh

SURFACE_POINTS = 2048
INTERIOR_POINTS = 512
MAX_FACES = 6000


def derive(name: str, mesh: trimesh.Trimesh, rng: np.random.Generator,
           surface_points: int = SURFACE_POINTS,
           interior_points: int = INTERIOR_POINTS) -> GenericModel:
    """
    Return the GenericModel of a cleaned mesh; the same `rng` state gives the same model.

    A mesh of more than MAX_FACES faces is simplified, within 1 % of its longest side, because
    every candidate of the category is rendered many times.

    :param name: category name.
    :param mesh: from `load_mesh`; centred here if necessary.
    :param rng: for the samples.
    :param surface_points: number of samples on the surface.
    :param interior_points: number of samples in the volume.
    """
    mesh = mesh.copy()
    mesh.apply_translation(-mesh.bounds.mean(axis=0))
    solid = closed(mesh)
    if len(mesh.faces) > MAX_FACES:
        solid = mesh = _simplified(solid)
    interior, doubled = sample_interior(solid, interior_points, rng)
    points, face = trimesh.sample.sample_surface(solid, surface_points, seed=rng)[:2]
    symmetry = axis_symmetry(solid, rng)
    rotations, probability = resting_poses(solid, symmetry)
    return GenericModel(
        name=name,
        vertices=np.ascontiguousarray(mesh.vertices, np.float64),
        faces=np.ascontiguousarray(mesh.faces, np.int32),
        extents=np.array(mesh.extents, np.float64),
        surface_points=np.asarray(points, np.float32),
        surface_normals=np.asarray(solid.face_normals[face], np.float32),
        interior_points=interior.astype(np.float32),
        volume=float(solid.volume) / doubled,
        rest_rotations=rotations,
        rest_probability=probability,
        symmetry=symmetry)


def _simplified(solid: trimesh.Trimesh) -> trimesh.Trimesh:
    """Return the solid with at most about MAX_FACES faces, its bounding box centred again."""
    before, longest = to_manifold(solid), solid.extents.max()
    for share in (0.0005, 0.001, 0.002, 0.004, 0.007, 0.01):
        after = before.simplify(share * longest)
        if after.num_tri() <= MAX_FACES:
            break
    mesh = from_manifold(after)
    mesh.apply_translation(-mesh.bounds.mean(axis=0))
    return mesh


def sample_interior(solid: trimesh.Trimesh, count: int, rng: np.random.Generator,
                    columns: int = 6000) -> tuple[Float64Array, float]:
    """
    Return (points (count, 3), doubled): points uniform in a watertight mesh's volume.

    `doubled` is 1.0, or more if the surface intersects itself: the factor by which the signed
    volume counts the shared parts too often.

    Random lines parallel to the shortest axis cut the solid into intervals; laid end to end,
    these are sampled at equal steps from a random start. The length of a line inside a solid
    is proportional to volume, so the points are uniform, and thin sheets, for which rejection
    sampling is slow, cost no more than a ball.
    """
    axis = int(np.argmin(solid.extents))
    u, v = (axis + 1) % 3, (axis + 2) % 3
    low, high = solid.bounds
    x, y = rng.uniform(low[u], high[u], columns), rng.uniform(low[v], high[v], columns)
    order = np.argsort(x)
    x, y = x[order], y[order]
    line, depth, sign = _crossings(solid.triangles[:, :, [u, v, axis]], x, y)
    order = np.lexsort((depth, line))
    line, depth, sign = line[order], depth[order], sign[order]
    # A line that does not end outside grazed an edge between two faces: skip it.
    sound = (np.bincount(line, sign, minlength=columns) == 0)[line]
    line, depth, sign = line[sound], depth[sound], sign[sound]
    # The winding number after each crossing; the others end at zero, so one sum serves all.
    inside = np.cumsum(sign) > 0
    same = np.append(line[1:] == line[:-1], False)
    start = np.nonzero(inside & same)[0]
    length = depth[start + 1] - depth[start]
    total = np.cumsum(length)
    at = (np.arange(count) + rng.uniform()) * total[-1] / count
    pick = np.searchsorted(total, at, side='right').clip(max=len(total) - 1)
    points = np.empty((count, 3))
    points[:, u], points[:, v] = x[line[start[pick]]], y[line[start[pick]]]
    # A fresh draw along the interval: equal steps would follow the order of the lines.
    points[:, axis] = depth[start[pick]] + rng.uniform(size=count) * length[pick]
    return points[rng.permutation(count)], max(-(sign * depth).sum() / total[-1], 1e-9)


def _crossings(triangles: Float64Array, x: Float64Array,
               y: Float64Array) -> tuple[Int64Array, Float64Array, AnyArray]:
    """
    Return (line, depth, sign) of the crossings of vertical lines (x ascending, y) with triangles.

    :param triangles: (F, 3, 3) float64, third coordinate along the lines.
    :return: index of the line, coordinate along it, and +1 where the line enters (the face
        points down), -1 where it leaves.
    """
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    doubled = ((b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1])
               - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0]))
    first = np.searchsorted(x, triangles[:, :, 0].min(axis=1))
    last = np.searchsorted(x, triangles[:, :, 0].max(axis=1))
    keep = (np.abs(doubled) > 0) & (last > first)
    lines, depths, signs = [], [], []
    for f in np.nonzero(keep)[0]:
        s = slice(first[f], last[f])
        px, py = x[s], y[s]
        wb = ((px - a[f, 0]) * (c[f, 1] - a[f, 1])
              - (py - a[f, 1]) * (c[f, 0] - a[f, 0])) / doubled[f]
        wc = ((b[f, 0] - a[f, 0]) * (py - a[f, 1])
              - (b[f, 1] - a[f, 1]) * (px - a[f, 0])) / doubled[f]
        hit = np.nonzero((wb >= 0) & (wc >= 0) & (wb + wc <= 1))[0]
        lines.append(hit + first[f])
        depths.append(a[f, 2] + wb[hit] * (b[f, 2] - a[f, 2]) + wc[hit] * (c[f, 2] - a[f, 2]))
        signs.append(np.full(len(hit), 1 if doubled[f] < 0 else -1))
    return np.concatenate(lines), np.concatenate(depths), np.concatenate(signs)

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Features of foreground pixels that hold for any rig and any number of views.

All views are fused into one projective distance field over the table (free, surface, hidden)
and one graph of surface voxels with convex segments; a pixel's 3D point reads its features
from these, in a frame that gravity and the local surface give. Nothing depends on where the
cameras stand, so one forest serves every rig.
"""

from dataclasses import dataclass

from hooc_perception.core.classification.kernels import features, segments
from hooc_perception.core.classification.kernels import field as fields
from hooc_perception.core.classification.kernels.texture import textures
from hooc_perception.core.geometry import inverse
import numpy as np

FIELD_CELL_M = 0.005
VOXEL_M = 0.006
MARGIN_M = 0.10
MAX_CELLS = 40_000_000
# Felzenszwalb scales, from parts to clusters. ORIENTING names the one that most often is one
# object: its long axis turns half of the probes.
SEGMENT_SCALES = (1.2, 3.0, 6.0, 14.0)
ORIENTING = 1
SMALLEST_SEGMENT = 12
TEXTURE_ANGLE_RAD = 0.5


@dataclass(frozen=True)
class Pixels:
    """
    Foreground pixels of all views, camera by camera in row-major order.

    :ivar camera: (n,) uint8; `uv` (n, 2) uint16 column and row.
    :ivar points: (n, 3) float64 world; `normals` (n, 3) float32 facing the camera;
        `residual` (n,) float32 metres, mean absolute residual of the local plane.
    """

    camera: np.ndarray
    uv: np.ndarray
    points: np.ndarray
    normals: np.ndarray
    residual: np.ndarray


def draw_probes(rng, n):
    """
    Return (n, 5) float64 random field probes for `point_features`.

    Radii are log-uniform from 1 to 25 cm; a third of the probes reads at a fixed height
    above the table instead of relative to the pixel.
    """
    radius = np.exp(rng.uniform(np.log(0.01), np.log(0.25), n))
    direction = rng.normal(size=(n, 3))
    direction[:, 2] *= 0.6
    offset = radius[:, None] * direction / np.linalg.norm(direction, axis=1, keepdims=True)
    absolute = rng.random(n) < 1 / 3
    offset[absolute, 2] = np.exp(rng.uniform(np.log(0.008), np.log(0.2), absolute.sum()))
    frame = np.arange(n) % 2
    return np.column_stack([frame, absolute, offset]).astype(np.float64)


def foreground_pixels(observation):
    """Return the Pixels of an Observation: every foreground pixel with its local plane."""
    parts = []
    for index, view in enumerate(observation.views):
        rows, cols = np.nonzero(view.foreground & np.isfinite(view.depth))
        K, T = np.ascontiguousarray(view.camera.K, np.float64), view.camera.T_world_camera
        R = np.ascontiguousarray(T[:3, :3])
        depth = np.ascontiguousarray(view.depth, np.float32)
        normal, residual = fields.normals(depth, rows, cols, K, R, 3, 0.02)
        d = depth[rows, cols].astype(np.float64)
        local = np.column_stack([(cols - K[0, 2]) / K[0, 0] * d,
                                 (rows - K[1, 2]) / K[1, 1] * d, d])
        parts.append((np.full(len(rows), index, np.uint8),
                      np.column_stack([cols, rows]).astype(np.uint16),
                      local @ R.T + T[:3, 3], normal, residual))
    return Pixels(*(np.concatenate(column) for column in zip(*parts)))


def feature_count(n_probes):
    """Return the number of columns that `pixel_features` makes."""
    return (features.FIXED_FEATURES + n_probes
            + len(SEGMENT_SCALES) * (segments.SEGMENT_FEATURES + 4))


@dataclass(frozen=True)
class Surroundings:
    """The fused field, the height map, and the voxel graph with its segments."""

    origin: np.ndarray
    cell: float
    field: np.ndarray
    heights: np.ndarray
    voxel: np.ndarray
    voxel_points: np.ndarray
    voxel_normals: np.ndarray
    pairs: np.ndarray
    weight: np.ndarray
    texture: np.ndarray
    ids: np.ndarray
    frames: np.ndarray
    shapes: np.ndarray


def surroundings(observation, pixels):
    """Return the Surroundings of an Observation with at least one foreground pixel."""
    low, high = pixels.points.min(0), pixels.points.max(0)
    low = np.array([low[0] - MARGIN_M, low[1] - MARGIN_M, -0.02])
    size = high + [MARGIN_M, MARGIN_M, 0.06] - low
    cell = max(FIELD_CELL_M, float(np.cbrt(np.prod(size) / MAX_CELLS)))
    shape = tuple(int(n) for n in np.ceil(size / cell) + 1)
    views = observation.views
    heights = np.array([v.depth.shape[0] for v in views])
    widths = np.array([v.depth.shape[1] for v in views])
    depths = np.full((len(views), heights.max(), widths.max()), np.nan, np.float32)
    for i, view in enumerate(views):
        depths[i, :heights[i], :widths[i]] = view.depth
    field = fields.fuse_field(
        depths, heights, widths, np.stack([np.asarray(v.camera.K, np.float64) for v in views]),
        np.stack([inverse(v.camera.T_world_camera) for v in views]), low, cell, shape)
    voxel_cell = VOXEL_M * cell / FIELD_CELL_M
    grid_shape = tuple(int(n) for n in np.ceil(size / voxel_cell) + 1)
    voxel, mean, normal, grid = segments.voxelise(
        pixels.points, pixels.normals.astype(np.float64), low, voxel_cell, grid_shape)
    pairs, weight = segments.edges(mean, normal, grid, low, voxel_cell)
    texture = textures(mean, normal, pairs, np.exp(-(weight / TEXTURE_ANGLE_RAD) ** 2))
    order = np.argsort(weight, kind='stable')
    ids = np.stack([segments.segment(len(mean), pairs, weight, order, k, SMALLEST_SEGMENT)
                    for k in SEGMENT_SCALES])
    most = int(ids.max()) + 1
    frames = np.zeros((len(ids), most, 5))
    shapes = np.zeros((len(ids), most, segments.SEGMENT_FEATURES), np.float32)
    for level, row in enumerate(ids):
        n = int(row.max()) + 1
        frames[level, :n], shapes[level, :n] = segments.describe(row, n, mean, normal, voxel_cell)
    top = features.height_map(pixels.points, low, cell, shape[0], shape[1])
    return Surroundings(low, cell, field, top, voxel, mean, normal, pairs, weight, texture, ids,
                        frames, shapes)


def pixel_features(pixels, around, probes, rows):
    """
    Return (len(rows), feature_count(len(probes))) float32 features of the chosen pixels.

    :param rows: (k,) integer rows of `pixels`.
    :param probes: (P, 5) from `draw_probes`; part of a trained classifier.
    """
    out = np.empty((len(rows), feature_count(len(probes))), np.float32)
    features.point_features(
        pixels.points[rows], pixels.normals[rows].astype(np.float64), pixels.residual[rows],
        around.field, around.origin, around.cell, around.heights, around.voxel[rows],
        around.texture, around.ids, around.frames, around.shapes, ORIENTING,
        np.ascontiguousarray(probes), out)
    return out

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Features of foreground pixels that hold for any rig and any number of views.

All views are fused into one projective distance field over the table (free, surface, hidden)
and one graph of surface voxels with convex segments. A pixel's 3D point reads its features
from these, in a frame given by gravity and the local surface. Nothing depends on where the
cameras stand, so one forest serves every rig.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from hooc_perception.core.arrays import (
    AnyArray,
    BoolArray,
    Float32Array,
    Float64Array,
    Int32Array,
    UInt8Array,
    UInt16Array,
)
from hooc_perception.core.classification.kernels import (
    features,
    plane_normals,
    projective_field,
    segments,
)
from hooc_perception.core.classification.kernels.projective_field import (
    DepthImages,
    ProjectiveField,
)
from hooc_perception.core.classification.kernels.texture import textures
from hooc_perception.core.classification.table_network import (
    Surface,
    table_map,
    TableMap,
    TableNetwork,
)
from hooc_perception.core.geometry import inverse
from hooc_perception.core.types import Observation, ObservedView
import numpy as np

FIELD_CELL_M = 0.005
VOXEL_M = 0.006
# The grids reach beyond the foreground: sideways, below the table, above the highest point.
MARGIN_M, BELOW_M, ABOVE_M = 0.10, 0.02, 0.06
# A larger scene gets larger cells instead of more.
MAX_CELLS = 40_000_000
# Felzenszwalb scales, from parts to clusters. ORIENTING is the one that most often is one
# object: its long axis turns half of the probes.
SEGMENT_SCALES = (1.2, 3.0, 6.0, 14.0)
ORIENTING = 1
SMALLEST_SEGMENT = 12
TEXTURE_ANGLE_RAD = 0.5
NORMAL_WINDOW = plane_normals.Window(half=3, gate_m=0.02)


@dataclass(frozen=True)
class Pixels:
    """
    Foreground pixels of all views, camera by camera in row-major order.

    :ivar camera: (n,) uint8; `uv` (n, 2) uint16 column and row.
    :ivar points: (n, 3) float64 world; `normals` (n, 3) float32 facing the camera;
        `residual` (n,) float32 metres, mean absolute residual of the local plane.
    """

    camera: UInt8Array
    uv: UInt16Array
    points: Float64Array
    normals: Float32Array
    residual: Float32Array


def draw_probes(rng: np.random.Generator, n: int) -> Float64Array:
    """
    Return (n, 5) float64 random field probes, columns as in `kernels.features`.

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


def foreground_pixels(observation: Observation) -> Pixels:
    """Return the Pixels of an Observation: every foreground pixel with its local plane."""
    camera, uv, points, normals, residuals = [], [], [], [], []
    for index, view in enumerate(observation.views):
        rows, cols = np.nonzero(view.foreground & np.isfinite(view.depth))
        K, T = np.ascontiguousarray(view.camera.K, np.float64), view.camera.T_world_camera
        R = np.ascontiguousarray(T[:3, :3])
        depth = np.ascontiguousarray(view.depth, np.float32)
        normal, residual = plane_normals.plane_normals(depth, rows, cols, K, R, NORMAL_WINDOW)
        d = depth[rows, cols].astype(np.float64)
        local = np.column_stack([(cols - K[0, 2]) / K[0, 0] * d,
                                 (rows - K[1, 2]) / K[1, 1] * d, d])
        camera.append(np.full(len(rows), index, np.uint8))
        uv.append(np.column_stack([cols, rows]).astype(np.uint16))
        points.append(local @ R.T + T[:3, 3])
        normals.append(normal)
        residuals.append(residual)
    return Pixels(np.concatenate(camera), np.concatenate(uv), np.concatenate(points),
                  np.concatenate(normals), np.concatenate(residuals))


def feature_count(n_probes: int, network: TableNetwork | None = None) -> int:
    """Return the number of columns that `pixel_features` makes."""
    own = (features.FIXED_FEATURES + n_probes
           + len(SEGMENT_SCALES) * (segments.SEGMENT_FEATURES + features.PLACE_FEATURES))
    return own + (network.columns if network else 0)


@dataclass(frozen=True)
class Surroundings:
    """
    The fused field, the height map, and the voxel graph with its segments.

    :ivar heights: (nx, ny) float32 metres, on the cells of the field.
    :ivar voxel: (n,) int32 voxel of each of the Pixels.
    :ivar voxel_points: (m, 3) float64 mean of the points of a voxel; `voxel_normals` (m, 3).
    :ivar pairs: (e, 2) int32 voxels that touch; `weight` (e,) float32, see `segments.edges`.
    :ivar texture: (m, TEXTURE_FEATURES) float32, see `texture.textures`.
    :ivar table: what a network sees, None where there is none.
    """

    field: ProjectiveField
    heights: Float32Array
    voxel: Int32Array
    voxel_points: Float64Array
    voxel_normals: Float64Array
    pairs: Int32Array
    weight: Float32Array
    texture: Float32Array
    segments: features.Segments
    table: TableMap | None


def surroundings(observation: Observation, pixels: Pixels, table: bool = False) -> Surroundings:
    """
    Return the Surroundings of an Observation with at least one foreground pixel.

    :param table: whether a network is to be asked.
    """
    low, high = pixels.points.min(0), pixels.points.max(0)
    low = np.array([low[0] - MARGIN_M, low[1] - MARGIN_M, -BELOW_M])
    size = high + [MARGIN_M, MARGIN_M, ABOVE_M] - low
    cell = max(FIELD_CELL_M, float(np.cbrt(np.prod(size) / MAX_CELLS)))
    nx, ny, nz = (int(n) for n in np.ceil(size / cell) + 1)
    images, foreground = depth_images(observation.views)
    rises = cell * np.arange(nz, dtype=np.float64)
    values = projective_field.fuse(images, low, cell, (nx, ny), rises)
    voxel_cell = VOXEL_M * cell / FIELD_CELL_M
    gx, gy, gz = (int(n) for n in np.ceil(size / voxel_cell) + 1)
    voxel, mean, normal, grid = segments.voxelise(
        pixels.points, pixels.normals.astype(np.float64), low, voxel_cell, (gx, gy, gz))
    pairs, weight = segments.edges(mean, normal, grid, low, voxel_cell)
    texture = textures(mean, normal, pairs, np.exp(-(weight / TEXTURE_ANGLE_RAD) ** 2))
    heights = features.height_map(pixels.points, low, cell, nx, ny)
    return Surroundings(ProjectiveField(values, low, cell), heights, voxel, mean, normal, pairs,
                        weight, texture, _segments(mean, normal, pairs, weight, voxel_cell),
                        table_map(images, foreground, pixels.points) if table else None)


def depth_images(views: Sequence[ObservedView]) -> tuple[DepthImages, BoolArray]:
    """Return the depth images and foregrounds (V, H, W) of views of any size."""
    heights = np.array([v.depth.shape[0] for v in views])
    widths = np.array([v.depth.shape[1] for v in views])
    depth = np.full((len(views), heights.max(), widths.max()), np.nan, np.float32)
    foreground = np.zeros(depth.shape, bool)
    for i, view in enumerate(views):
        depth[i, :heights[i], :widths[i]] = view.depth
        foreground[i, :heights[i], :widths[i]] = view.foreground
    return DepthImages(
        depth, heights, widths, np.stack([np.asarray(v.camera.K, np.float64) for v in views]),
        np.stack([inverse(v.camera.T_world_camera) for v in views])), foreground


def _segments(mean: Float64Array, normal: Float64Array, pairs: Int32Array, weight: Float32Array,
              cell: float) -> features.Segments:
    """Return the convex segments of a voxel graph at all SEGMENT_SCALES, with their shapes."""
    order = np.argsort(weight, kind='stable')
    ids = segments.segment_at(np.array(SEGMENT_SCALES), len(mean), pairs, weight, order,
                              SMALLEST_SEGMENT)
    most = int(ids.max()) + 1
    frames = np.zeros((len(ids), most, segments.FRAME_COLUMNS))
    shapes = np.zeros((len(ids), most, segments.SEGMENT_FEATURES), np.float32)
    for level, row in enumerate(ids):
        n = int(row.max()) + 1
        frames[level, :n], shapes[level, :n] = segments.describe(row, n, mean, normal, cell)
    return features.Segments(ids, frames, shapes, ORIENTING)


def pixel_features(pixels: Pixels, around: Surroundings, probes: Float64Array,
                   rows: AnyArray, network: TableNetwork | None = None) -> Float32Array:
    """
    Return (len(rows), feature_count(len(probes), network)) float32 features of the chosen pixels.

    :param rows: (k,) integer rows of `pixels`.
    :param probes: (P, 5) from `draw_probes`; part of a trained classifier.
    :param network: describes the pixels on the map of `around` in the last columns.
    """
    out = np.empty((len(rows), feature_count(len(probes))), np.float32)
    queries = features.Queries(pixels.points[rows], pixels.normals[rows].astype(np.float64),
                               pixels.residual[rows], around.voxel[rows])
    features.point_features(queries, around.field, around.heights, around.texture,
                            around.segments, np.ascontiguousarray(probes), out)
    if network is None:
        return out
    assert around.table is not None
    surface = Surface(pixels.points[rows], pixels.normals[rows], pixels.residual[rows])
    return np.concatenate([out, network.describe(around.table, surface)], axis=1)

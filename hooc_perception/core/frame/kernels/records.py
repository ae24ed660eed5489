# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Groups of arrays that the kernels take as one argument.

numba takes named tuples as they are. Parallel kernels take flat ones only, so Target, which
nests them, is put together inside their loops.
"""

from typing import NamedTuple

from hooc_perception.core.arrays import (
    BoolArray,
    Float32Array,
    Float64Array,
    Int32Array,
    Int64Array,
    UInt8Array,
)


class Views(NamedTuple):
    """
    The pixels of V views, stacked: view after view, row after row, P in all.

    :ivar K: (V, 3, 3) float64 intrinsics.
    :ivar R: (V, 3, 3) float64 R_camera_world; `t` (V, 3) t_camera_world, metres.
    :ivar size: (V, 2) int64 width and height.
    :ivar first: (V + 1,) int64, first pixel of each view, then P.
    :ivar depth: (P,) float32 measured metres, NaN = no reading.
    :ivar foreground: (P,) bool.
    :ivar normals: (P, 3) float32 measured, unit, world; NaN = none.
    :ivar patch: (P,) int32 smooth patch, -1 = none; `patch_size` (patches,) int64 pixels of each
        over all views.
    :ivar p: (M, N + 1) uint8, category probability x 255; `p_row` (P,) int32 row of each pixel
        therein, -1 = none.
    """

    K: Float64Array
    R: Float64Array
    t: Float64Array
    size: Int64Array
    first: Int64Array
    depth: Float32Array
    foreground: BoolArray
    normals: Float32Array
    patch: Int32Array
    patch_size: Int64Array
    p: UInt8Array
    p_row: Int32Array


class Meshes(NamedTuple):
    """
    All S meshes, concatenated; mesh s has rows start[s] to start[s + 1] - 1.

    :ivar vertices: (., 3) float64, model frame; `vertex_start` (S + 1,) int64.
    :ivar faces: (., 3) int32 into the vertices of their own model; `face_start` (S + 1,) int64.
    :ivar closed: (S,) bool, whether faces turned away from the camera need no drawing.
    """

    vertices: Float64Array
    vertex_start: Int64Array
    faces: Int32Array
    face_start: Int64Array
    closed: BoolArray


class Context(NamedTuple):
    """
    What is shown already at each of P pixels: the nearest member and the next behind it.

    :ivar owner: (P,) int32 nearest member, -2 = none.
    :ivar depth: (P,) float32 of the nearest member, metres, inf = none; `cost` (P,) float32 of
        showing it, or of showing nothing where there is none.
    :ivar next_depth: the same of the next one; `next_cost` likewise.
    """

    owner: Int32Array
    depth: Float32Array
    cost: Float32Array
    next_depth: Float32Array
    next_cost: Float32Array


class PixelWeights(NamedTuple):
    """
    What a pixel costs; a foreground pixel that shows no object costs 1, a table pixel 0.

    :ivar tolerance_m: depth residual that costs as much as showing no object, metres.
    :ivar normal: cost of a perpendicular normal.
    :ivar category: cost of a category that the classifier rules out.
    :ivar free: cost of a free-space violation: a surface was measured behind the object.
    """

    tolerance_m: float = 0.03
    normal: float = 0.4
    category: float = 0.4
    free: float = 0.7


class Hypotheses(NamedTuple):
    """
    Hypotheses to be compared, each by itself.

    :ivar rows: (m, 10) float64, see core/kernels/pose.py.
    :ivar shape: (m,) int64 numbers of their meshes; `category` (m,) int64 class ids.
    :ivar me: (m,) int64, the number of each in the context, where it is looked through; -1 = it
        is not in there.
    """

    rows: Float64Array
    shape: Int64Array
    category: Int64Array
    me: Int64Array


class Target(NamedTuple):
    """All that a hypothesis is rendered with and compared to."""

    views: Views
    meshes: Meshes
    context: Context
    weights: PixelWeights


class PixelOutput(NamedTuple):
    """
    Room for the pixels that hypotheses cover.

    :ivar start: (m,) int64, where each writes its first pixel; -1 = it writes none.
    :ivar pixel: (E,) int64; `depth` (E,) float32 metres; `cost` (E,) float32.
    """

    start: Int64Array
    pixel: Int64Array
    depth: Float32Array
    cost: Float32Array


class RefineSettings(NamedTuple):
    """
    How hypotheses are refined in the images.

    :ivar complexity: cost per covered pixel.
    :ivar size_prior: cost of the squared log scale, per covered pixel.
    :ivar steps: trials per hypothesis.
    :ivar translation: initial size of random steps, metres; `rotation` radians, `log_scale`.
    """

    complexity: float
    size_prior: float
    steps: int
    translation: float
    rotation: float
    log_scale: float


class Field(NamedTuple):
    """
    A voxel grid of what is known about the nearest surface, see core/frame/kernels/field.py.

    :ivar data: (X, Y, Z, 8) uint8 channels: distance 0, free-space evidence 1, normal 2-4,
        signed distance to the tangent plane 5; the others are unused.
    :ivar origin: (3,) float64 world corner of voxel (0, 0, 0), metres.
    :ivar voxel: side of a voxel, metres.
    :ivar truncation: distance that channel 0 = 255 stands for, metres.
    """

    data: UInt8Array
    origin: Float64Array
    voxel: float
    truncation: float

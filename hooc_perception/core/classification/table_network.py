# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
A convolutional network over the map of the table, whose output the fused forest reads.

The forest asks what is around a pixel, at places that are fixed beforehand; the network has
learned where to look. It is a U-Net (Ronneberger et al. 2015) over an orthographic map of 5 mm
cells, so that it knows neither cameras nor views, and a perceptron that takes the network's layers
at a pixel's place with the pixel's own height and normal. It has been trained once, on synthetic
scenes of the built-in catalogue (training/network), and is part of a model like any other array.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from hashlib import blake2b
from threading import Lock
from typing import NamedTuple

import cv2
from hooc_perception.core.arrays import (
    AnyArray,
    BoolArray,
    Float32Array,
    Float64Array,
    Int8Array,
    UInt8Array,
)
from hooc_perception.core.classification.kernels import projective_field
from hooc_perception.core.classification.kernels import table_map as kernels
from hooc_perception.core.classification.kernels.projective_field import DepthImages
from hooc_perception.core.memo import latest
from hooc_perception.errors import HoocError
import numpy as np

# Heights of the field's slices above the support plane.
SLICES_M = np.array([0.005, 0.01, 0.015, 0.02, 0.03, 0.04, 0.05, 0.065, 0.08, 0.1, 0.12, 0.15,
                     0.18, 0.22, 0.27, 0.33])
# Cells of the map, how far it reaches beyond the foreground, and how many cells it has per side: a
# larger scene gets larger cells instead of more.
CELL_M, MARGIN_M, FEWEST_CELLS, MOST_CELLS = 0.005, 0.1, 208, 512
# The first level of the network has half the map's cells per side, each other one half of the one
# before.
LEVELS = 4
GRANULE = 1 << LEVELS
CHANNELS = len(SLICES_M) + kernels.HEIGHT_LAYERS
# Heights at which the perceptron's code of a pixel's height is steep.
HEIGHT_KNOTS_M = np.array([0.005, 0.012, 0.02, 0.035, 0.05, 0.08, 0.12, 0.18, 0.26], np.float32)
POINT_FEATURES = len(HEIGHT_KNOTS_M) + 6
LOWEST_M = 0.002
PREFIX, PERCEPTRON_LAYERS = 'network_', 3
DAMAGED = 'the classifier holds a damaged network; train the model again'


@dataclass(frozen=True)
class Grid:
    """
    Where the cells of a map are.

    :ivar origin: (3,) float64 centre of cell (0, 0) on the support plane, metres, table frame.
    :ivar cell: side of a cell, metres; `shape` (nx, ny).
    """

    origin: Float64Array
    cell: float
    shape: tuple[int, int]


class FusedMap(NamedTuple):
    """
    All views over a Grid.

    :ivar slices: (len(SLICES_M), nx, ny) int8 of the projective field.
    :ivar layers: (HEIGHT_LAYERS, nx, ny) float32 from `kernels.table_map.heights`.
    """

    slices: Int8Array
    layers: Float32Array


@dataclass(frozen=True)
class TableMap:
    """
    What the network sees.

    :ivar channels: (CHANNELS, nx, ny) float32; nx and ny are multiples of GRANULE.
    """

    channels: Float32Array
    grid: Grid


@dataclass(frozen=True)
class Surface:
    """
    Points of which the network is asked.

    :ivar points: (n, 3) float64 metres, table frame; `normals` (n, 3) float32 towards the camera;
        `residual` (n,) float32 metres, of the local plane.
    """

    points: Float64Array
    normals: Float32Array
    residual: Float32Array


def grid_around(points: Float64Array) -> Grid:
    """Return the Grid of a map with points (n, 3) of the foreground in its middle, n >= 1."""
    low, high = points[:, :2].min(0), points[:, :2].max(0)
    extents = high - low + 2 * MARGIN_M
    cell = max(CELL_M, float(extents.max()) / MOST_CELLS)
    nx, ny = (max(FEWEST_CELLS, GRANULE * int(np.ceil(side / cell / GRANULE)))
              for side in extents)
    return centred((low + high) / 2, cell, (nx, ny))


def centred(middle: Float64Array, cell: float, shape: tuple[int, int]) -> Grid:
    """Return the Grid around a point (2,) of the support plane."""
    return Grid(np.array([*(middle - np.array(shape) * cell / 2), 0.0]), cell, shape)


def fuse(images: DepthImages, foreground: BoolArray, grid: Grid) -> FusedMap:
    """
    Return the slices and layers of a Grid.

    :param foreground: (V, H, W), padded as the images are.
    """
    field = projective_field.fuse(images, grid.origin, grid.cell, grid.shape, SLICES_M)
    return FusedMap(np.ascontiguousarray(field.transpose(2, 0, 1)), kernels.heights(
        images, foreground, grid.origin, grid.cell, grid.shape))


def table_map(images: DepthImages, foreground: BoolArray, points: Float64Array) -> TableMap:
    """
    Return the TableMap of depth images.

    :param points: (n, 3) float64 of the foreground, at least one.
    """
    grid = grid_around(points)
    return TableMap(channels(*fuse(images, foreground, grid)), grid)


def channels(slices: Int8Array, layers: Float32Array) -> Float32Array:
    """
    Return the CHANNELS of a map, each about within -1 and 1.

    :param slices, layers: as those of a FusedMap.
    """
    field = slices.astype(np.float32)
    levels = np.clip(layers[:kernels.COUNT], -0.03, 0.4)
    # Steep near the table, where the flat things are.
    return np.concatenate([field / (20 + np.abs(field)), np.tanh((levels - 0.01) * 30),
                           0.1 * np.log1p(layers[kernels.COUNT:])]).astype(np.float32)


def halved(maps: Float32Array) -> Float32Array:
    """Return (4 C, nx / 2, ny / 2): each 2 x 2 cells of maps (C, nx, ny) as channels of one."""
    count, nx, ny = maps.shape
    blocks = maps.reshape(count, nx // 2, 2, ny // 2, 2).transpose(0, 2, 4, 1, 3)
    return np.ascontiguousarray(blocks.reshape(4 * count, nx // 2, ny // 2))


def point_features(surface: Surface) -> Float32Array:
    """Return (n, POINT_FEATURES) float32: what the perceptron reads of the points themselves."""
    z = surface.points[:, 2].astype(np.float32)
    return np.concatenate([
        np.tanh((z[:, None] - HEIGHT_KNOTS_M) * 40), 10 * z[:, None],
        0.5 * np.log(np.maximum(z, LOWEST_M))[:, None], surface.normals,
        np.minimum(200 * surface.residual, 3)[:, None]], axis=1).astype(np.float32)


class TableNetwork:
    """
    The network with its perceptron.

    :param net: (n,) uint8, an ONNX file: from `channels` to the outputs level0, level1, ...
    :param layers: weights (out, in) and biases (out,) of the perceptron, from first to last.
    """

    def __init__(self, net: UInt8Array, layers: Sequence[tuple[Float32Array, Float32Array]],
                 ) -> None:
        self._net = cv2.dnn.readNetFromONNX(net)
        self._layers = [(np.ascontiguousarray(weight.T), bias) for weight, bias in layers]
        self._lock = Lock()

    @property
    def columns(self) -> int:
        """Return the number of features that `describe` gives."""
        *_, (_, inner), (_, last) = self._layers
        return len(inner) + len(last)

    def describe(self, table: TableMap, surface: Surface) -> Float32Array:
        """
        Return (n, columns) float32 of the points of a Surface.

        These are the perceptron's last hidden layer and its logits, of which the forest makes
        classes: the network's own classes are not those of the model.
        """
        hidden = np.concatenate([*self._levels(table, surface.points), point_features(surface)],
                                axis=1)
        for weight, bias in self._layers[:-1]:
            hidden = np.maximum(kernels.dense(hidden, weight, bias), 0)
        return np.concatenate([hidden, kernels.dense(hidden, *self._layers[-1])], axis=1)

    def _levels(self, table: TableMap, points: Float64Array) -> Iterator[Float32Array]:
        """Yield (n, C) float32 of each of the network's levels at the points' places."""
        places = (points[:, :2] - table.grid.origin[:2]) / table.grid.cell
        # The outputs are OpenCV's memory until the next call.
        with self._lock:
            self._net.setInput(halved(table.channels)[None])
            levels = self._net.forward([f'level{k}' for k in range(LEVELS)])
            for k, layers in enumerate(levels):
                out = np.empty((len(points), layers.shape[1]), np.float32)
                kernels.sample(layers[0], (places + 0.5) / (2 << k) - 0.5, out)
                yield out


def with_digest(arrays: Mapping[str, AnyArray], prefix: str = PREFIX) -> dict[str, AnyArray]:
    """Return the arrays of a network and their digest, which tells one network from another."""
    digest = blake2b(digest_size=16)
    for key in sorted(arrays):
        digest.update(np.ascontiguousarray(arrays[key]).tobytes())
    return {**arrays, prefix + 'digest': np.frombuffer(digest.digest(), np.uint8)}


def from_arrays(arrays: Mapping[str, AnyArray], prefix: str = PREFIX) -> TableNetwork | None:
    """
    Return the TableNetwork stored under `prefix` in a dict of arrays, None where there is none.

    :raises HoocError: if it is damaged.
    """
    if prefix + 'net' not in arrays:
        return None
    try:
        return _built({key.removeprefix(prefix): array for key, array in arrays.items()
                       if key.startswith(prefix)})
    except (KeyError, ValueError, TypeError, cv2.error):
        raise HoocError(DAMAGED)


@latest(2, key=lambda arrays: bytes(arrays['digest']))
def _built(arrays: Mapping[str, AnyArray]) -> TableNetwork:
    """Return the TableNetwork of arrays; reading the file of a network takes a while."""
    layers = [(np.ascontiguousarray(arrays[f'weight{k}'], np.float32),
               np.ascontiguousarray(arrays[f'bias{k}'], np.float32))
              for k in range(PERCEPTRON_LAYERS)]
    return TableNetwork(np.ascontiguousarray(arrays['net'], np.uint8), layers)

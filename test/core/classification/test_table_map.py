# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The map of the table against plain references."""

from hooc_perception.core.classification import features, table_network
from hooc_perception.core.classification.kernels import table_map
from hooc_perception.core.geometry import back_project
import numpy as np
import pytest
from scipy.ndimage import map_coordinates


@pytest.fixture(scope='module')
def scene(small):
    """Two boxes that stand apart, seen by three cameras."""
    meshes = [small.box([-0.15, 0.0, 0.05], [0.1, 0.16, 0.1]),
              small.box([0.15, 0.05, 0.03], [0.2, 0.06, 0.06])]
    observation = small.observed(meshes)
    return observation, features.foreground_pixels(observation)


@pytest.fixture(scope='module')
def fused(scene):
    observation, pixels = scene
    grid = table_network.grid_around(pixels.points)
    return grid, table_network.fuse(*features.depth_images(observation.views), grid)


def plain_layers(observation, grid):
    """Return the layers of `heights` from lists of readings."""
    cells = {}
    for view in observation.views:
        points = back_project(view.depth, view.camera)
        for point, front in zip(points[np.isfinite(view.depth)],
                                view.foreground[np.isfinite(view.depth)]):
            cell = np.floor((point[:2] - grid.origin[:2]) / grid.cell + 0.5).astype(int)
            if table_map.LOWEST_M < point[2] < table_map.HIGHEST_M:
                cells.setdefault(tuple(cell), []).append((point[2], front))
    out = np.zeros((table_map.HEIGHT_LAYERS, *grid.shape), np.float32)
    out[[table_map.MEAN, table_map.HIGHEST, table_map.FRONT_LOWEST,
         table_map.FRONT_HIGHEST]] = table_map.EMPTY_M
    for (i, j), readings in cells.items():
        if not (0 <= i < grid.shape[0] and 0 <= j < grid.shape[1]):
            continue
        z = np.array([height for height, _ in readings])
        front = z[np.array([kind for _, kind in readings])]
        out[table_map.MEAN, i, j], out[table_map.COUNT, i, j] = z.mean(), len(z)
        out[table_map.HIGHEST, i, j] = max(z.max(), table_map.EMPTY_M)
        if len(front):
            out[table_map.FRONT_COUNT, i, j] = len(front)
            out[table_map.FRONT_LOWEST, i, j] = front.min()
            out[table_map.FRONT_HIGHEST, i, j] = max(front.max(), table_map.EMPTY_M)
    return out


def test_layers_are_those_of_a_plain_loop_over_the_readings(scene, fused):
    grid, got = fused
    want = plain_layers(scene[0], grid)
    # A reading at the border of two cells may fall into either.
    assert np.mean(np.abs(got.layers - want) < 1e-4) > 0.999
    assert got.layers[table_map.FRONT_COUNT].sum() > 1000


def test_slices_are_those_of_the_field_at_their_heights(scene, fused):
    grid, got = fused
    i, j = (np.array([-0.15, 0.0]) - grid.origin[:2]) / grid.cell
    column = got.slices[:, round(i), round(j)].astype(int)
    inside = table_network.SLICES_M < 0.09
    assert (column[inside] < 0).all() and (column[table_network.SLICES_M > 0.11] > 0).all()


def test_the_foreground_is_in_the_middle_and_both_sides_divide(scene):
    grid = table_network.grid_around(scene[1].points)
    middle = (scene[1].points[:, :2].min(0) + scene[1].points[:, :2].max(0)) / 2
    assert np.abs(grid.origin[:2] + np.array(grid.shape) * grid.cell / 2 - middle).max() < 1e-9
    assert all(n % table_network.GRANULE == 0 for n in grid.shape)


def test_a_wide_scene_gets_larger_cells_and_no_more_than_the_most():
    grid = table_network.grid_around(np.array([[-5.0, -1.0, 0.1], [5.0, 1.0, 0.1]]))
    assert max(grid.shape) <= table_network.MOST_CELLS and grid.cell > table_network.CELL_M
    assert grid.shape[0] * grid.cell > 10.0


def test_interpolation_is_bilinear_and_takes_the_border_beyond():
    rng = np.random.default_rng(0)
    layers = rng.random((3, 12, 9), np.float32)
    places = rng.uniform([-3, -3], [14, 12], (200, 2))
    out = np.empty((200, 3), np.float32)
    table_map.sample(layers, places, out)
    want = np.stack([map_coordinates(layer.astype(float), places.T, order=1, mode='nearest')
                     for layer in layers], 1)
    assert np.abs(out - want).max() < 1e-5


def test_a_dense_layer_is_a_product_with_a_bias():
    rng = np.random.default_rng(0)
    x, weight, bias = (rng.normal(size=shape).astype(np.float32)
                       for shape in ((50, 30), (30, 20), (20,)))
    x[::3, ::2] = 0
    assert np.abs(table_map.dense(x, weight, bias) - (x @ weight + bias)).max() < 1e-4


def test_halving_keeps_every_cell_of_a_block():
    maps = np.arange(2 * 4 * 6, dtype=np.float32).reshape(2, 4, 6)
    halved = table_network.halved(maps)
    assert halved.shape == (8, 2, 3)
    assert halved[:, 1, 2].tolist() == [16, 17, 22, 23, 40, 41, 46, 47]

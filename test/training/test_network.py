# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Training of the network over the table: its examples, its batches, and the way into a model."""

from hooc_perception.core.classification import table_network
from hooc_perception.core.classification.kernels import table_map
from hooc_perception.core.classification.table_network import TableMap
from hooc_perception.io.scenes.scene_set import load_scene_set
from hooc_perception.objects.catalogue import variant, write_catalogue
from hooc_perception.objects.derive import derive
from hooc_perception.training.network.examples import Example, examples, ExamplesConfig
import numpy as np
import pytest


@pytest.fixture(scope='module')
def models():
    """Return generic models of a bowl and a book."""
    return tuple(derive(name, variant(name), np.random.default_rng(0), 64, 16)
                 for name in ('bowl', 'book'))


@pytest.fixture(scope='module')
def cameras(tmp_path_factory):
    """Return the cameras of the built-in catalogue."""
    return load_scene_set(write_catalogue(tmp_path_factory.mktemp('set')), False).cameras


@pytest.fixture(scope='module')
def made(models, cameras):
    """Return the Examples of two arrangements."""
    config = ExamplesConfig(arrangements=2, renders=2, relatives=0.0, strangers=0.0)
    counted = []
    found = examples(models, (), cameras, config, 0, 1, counted.append)
    assert sum(counted) == 2
    return found


def test_points_lie_where_the_map_has_readings(made):
    assert 2 <= len(made) <= 4
    for example in made:
        i, j = np.floor(example.points[:, :2] / table_network.CELL_M + 0.5).astype(int).T
        highest = example.layers[table_map.FRONT_HIGHEST, i, j]
        # A rounded point at the border of two cells may fall into the other one.
        assert (highest >= example.points[:, 2] - 2e-3).mean() > 0.95
        assert set(np.unique(example.y)) <= {0, 1, 2} and example.y.max() > 0


def test_the_same_seed_gives_the_same_examples(made, models, cameras):
    config = ExamplesConfig(arrangements=1, renders=2, relatives=0.0, strangers=0.0)
    again = examples(models, (), cameras, config, 0, 1, lambda _: None)
    for one, two in zip(made, again):
        assert (one.slices == two.slices).all() and (one.points == two.points).all()
        assert (one.y == two.y).all() and (one.layers == two.layers).all()


def blob(n=208):
    """Return an Example of one column beside the middle, with a point on it."""
    layers = np.zeros((table_map.HEIGHT_LAYERS, n, n), np.float16)
    layers[table_map.FRONT_HIGHEST, 124:132, 134:142] = 0.1
    return Example(np.zeros((len(table_network.SLICES_M), n, n), np.int8), layers,
                   np.array([[127.5, 137.5, 20]], np.float32) * 0.005,
                   np.array([[1, 0, 0]], np.float16), np.zeros(1, np.float16),
                   np.ones(1, np.uint8))


def test_a_turned_map_has_its_points_where_they_were():
    torch = pytest.importorskip('torch')
    from hooc_perception.training.network.batches import batch
    plain = batch([blob()], 1)
    channel = len(table_network.SLICES_M) + table_map.FRONT_HIGHEST
    high = plain.maps[0, channel].max()
    rng = np.random.default_rng(0)
    for _ in range(8):
        turned = batch([blob()], 1, rng, stretch=0.1)
        value = torch.nn.functional.grid_sample(
            turned.maps[:, channel:channel + 1], turned.places[:, :, None], align_corners=False)
        assert float(value) == pytest.approx(float(high), abs=0.05)
        normal = turned.points[0, 0, -4:-1].numpy()
        assert np.linalg.norm(normal) == pytest.approx(1.0) and normal[2] == 0


def test_an_exported_network_gives_the_same_logits():
    torch = pytest.importorskip('torch')
    pytest.importorskip('onnx')
    from hooc_perception.training.network.batches import batch
    from hooc_perception.training.network.export import exported
    from hooc_perception.training.network.model import PointNetwork
    torch.manual_seed(0)
    network = PointNetwork(5)
    example = blob()
    runtime = table_network.from_arrays(exported(network))
    assert runtime is not None
    grid = table_network.Grid(np.zeros(3), table_network.CELL_M, (208, 208))
    got = runtime.describe(TableMap(table_network.channels(example.slices, example.layers), grid),
                           example.surface)
    with torch.no_grad():
        want = network.eval()(*batch([example], 1)[:3])[0].numpy()
    assert got.shape == (1, runtime.columns) and np.abs(got[:, -5:] - want).max() < 1e-4

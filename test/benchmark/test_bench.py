# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The benchmark: contestants do the same work, and who does not is found out."""

import json

from hooc_perception.benchmark import learning, parsing, rendering
from hooc_perception.benchmark.measure import Contest, Contestant, hold
from hooc_perception.benchmark.scene import bench_scene
from hooc_perception.cli.bench import TOOLS
from hooc_perception.cli.main import main, with_default_tool
from hooc_perception.core.energy.eq1 import Eq1
from hooc_perception.core.render import render_depth
from hooc_perception.errors import HoocError
import numpy as np
import pytest


@pytest.fixture(scope='module')
def scene():
    """Return a BenchScene of few objects."""
    return bench_scene(n_objects=8)


def test_ratio_is_times_faster_than_the_last(monkeypatch):
    clock = iter(np.cumsum([0, 1] + [0, 2] * 3 + [0, 1] + [0, 8] * 3).tolist())
    monkeypatch.setattr('hooc_perception.benchmark.measure.now', lambda: next(clock))
    # Three runs of 2 s, then three of 8 s that stand for a quarter of the work.
    monkeypatch.setattr('hooc_perception.benchmark.measure.MIN_RUNS', 3)
    monkeypatch.setattr('hooc_perception.benchmark.measure.PATIENCE_S', 1e9)
    fast, slow = hold(Contest('s', 'w', (Contestant('fast', lambda: 1),
                                         Contestant('slow', lambda: 1, 0.25))))
    assert (fast.seconds, slow.seconds) == (2, 32)
    assert (fast.ratio, slow.ratio) == (16, 1)


def test_who_does_other_work_is_found_out():
    contest = Contest('s', 'w', (Contestant('ours', lambda: 1), Contestant('theirs', lambda: 2)),
                      lambda a, b: abs(a - b), 0.5)
    with pytest.raises(HoocError, match='theirs differs from ours by 1'):
        hold(contest)


def test_nan_counts_as_different():
    contest = Contest('s', 'w', (Contestant('a', lambda: 1), Contestant('b', lambda: 1)),
                      lambda a, b: float('nan'), 0.5)
    with pytest.raises(HoocError):
        hold(contest)


def test_memory_is_measured():
    entry, = hold(Contest('s', 'w', (Contestant('x', lambda: np.zeros(2 ** 20).sum()),)))
    assert entry.peak_mb == pytest.approx(8, rel=0.05)


def test_three_renderers_draw_the_same(scene):
    for camera in scene.cameras:
        ours = render_depth(scene.meshes, camera)[0]
        assert np.isfinite(ours).sum() > 1000
        for other in (rendering.cast, rendering.numpy_depth):
            assert rendering.differing_share(
                ours, other(scene.meshes, camera)) <= rendering.EDGE_SHARE


def test_a_shifted_picture_is_noticed(scene):
    ours = render_depth(scene.meshes, scene.cameras[0])[0]
    assert rendering.differing_share(ours, np.roll(ours, 1, axis=1)) > rendering.EDGE_SHARE


def test_sklearns_trees_are_converted_exactly():
    contest = learning.forest_contest()
    ours, theirs = (contestant.run() for contestant in contest.contestants)
    assert np.abs(ours - theirs).max() < contest.tolerance
    assert (ours.argmax(1) == theirs.argmax(1)).mean() > 0.97


def test_dense_energy_is_eq1(scene):
    energy = Eq1(scene.observation, scene.probabilities, scene.pool, scene.models)
    for mask in (scene.truth, ~scene.truth, np.zeros(len(scene.pool), bool)):
        assert parsing.dense_energy(scene, mask) == pytest.approx(energy.evaluate(mask), abs=1e-3)


def test_scene_is_deterministic_and_holds_its_truth(scene):
    again = bench_scene(n_objects=8)
    assert scene.truth.sum() == len(scene.meshes) == 8
    np.testing.assert_array_equal(scene.pool.translation, again.pool.translation)
    np.testing.assert_array_equal(scene.probabilities.p, again.probabilities.p)


def test_the_command(tmp_path, capsys):
    path = tmp_path / 'bench.json'
    assert main(['bench', '--stage', 'after each flip', '--json', str(path)]) == 0
    assert 'each from scratch' in capsys.readouterr().out
    content = json.loads(path.read_text())
    assert content['format'] == 'hooc-bench/1'
    assert [e['name'] for e in content['entries']][0] == 'incremental (ours)'
    assert content['entries'][-1]['ratio'] == 1


def test_an_unknown_stage_is_named(capsys):
    assert main(['bench', '--stage', 'dance']) == 1
    assert 'render a view' in capsys.readouterr().err


@pytest.mark.parametrize('words, command', [
    (['--growth', '--plot', 'a.png'], 'hooc bench growth'), (['--fuzz', '9'], 'hooc bench fuzz'),
    (['--plot', 'a.png', '--soak=3'], 'hooc bench soak')])
def test_options_of_earlier_versions_name_the_new_command(capsys, words, command):
    assert main(['bench', *words]) == 1
    error, = capsys.readouterr().err.splitlines()
    assert f'{words[0] if words[0] != "--plot" else "--soak"} has moved; use {command}' in error


@pytest.mark.parametrize('words, completed', [
    (['bench'], ['bench', 'speed']), (['bench', 'growth', '--seed', '1'],) * 2,
    (['--debug', 'bench', '--json', 'growth'], ['--debug', 'bench', 'speed', '--json', 'growth']),
    (['bench', '--debug', 'soak'],) * 2, (['bench', '--help'],) * 2, (['train', 'bench'],) * 2,
    ([], [])])
def test_bench_alone_measures_speed(words, completed):
    assert with_default_tool(words) == completed


@pytest.mark.parametrize('tool', list(TOOLS))
def test_every_tool_explains_itself(tool, capsys):
    with pytest.raises(SystemExit) as stop:
        main(['bench', tool, '--help'])
    assert stop.value.code == 0
    assert f'usage: hooc bench {tool}' in capsys.readouterr().out

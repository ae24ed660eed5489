# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""How a scene grows: settings that change one thing, categories that are added and left out."""

from types import SimpleNamespace

from hooc_perception.benchmark import growth
from hooc_perception.core.classification.forest import Forest
from hooc_perception.errors import HoocError
from hooc_perception.trained.folder import load_model_folder
import numpy as np
import pytest


@pytest.fixture(scope='module')
def folder(repository):
    return load_model_folder(repository / 'models' / 'demo')


def test_categories_are_left_out_or_copied_in_another_size(folder):
    models, arrays = growth.with_categories(folder.models, folder.classifier, 10,
                                            np.random.default_rng(0))
    assert models == folder.models[:10] and int(arrays['classes']) == 10
    assert Forest.from_arrays(arrays, 'forest_').leaf_p.shape[1] == 11
    models, arrays = growth.with_categories(folder.models, folder.classifier, 60,
                                            np.random.default_rng(0))
    assert len({m.name for m in models}) == 60
    ratio = models[30].extents / models[5].extents
    assert ratio == pytest.approx(np.full(3, ratio[0])) and abs(ratio[0] - 1) > 1e-3
    assert models[30].volume == pytest.approx(models[5].volume * ratio[0] ** 3)
    before = folder.classifier['forest_leaf_p'].astype(float)
    after = arrays['forest_leaf_p'].astype(float)
    # Three of category 6, two of category 20: together they get what the original got.
    for category, copies in ((6, (6, 31, 56)), (20, (20, 45))):
        shared = after[:, list(copies)].sum(axis=1)
        assert np.abs(shared - 255 * before[:, category] / before.sum(axis=1)).max() <= 2


def test_the_scene_is_the_same_whatever_the_categories_and_scales_with_pixels(folder):
    scene = growth.synthetic_scene(folder.models, 2, 6, 0.25, 0)
    small, large = scene.views, growth.synthetic_scene(folder.models[:10], 2, 6, 1.0, 0).views
    assert len(scene.objects) == 6 and len(small) == 2
    assert large[0].depth.size == pytest.approx(4 * small[0].depth.size, rel=0.01)
    # Every second ray of the larger image is about one of the smaller; noise differs.
    coarse = large[0].depth[1::2, 1::2][:small[0].depth.shape[0], :small[0].depth.shape[1]]
    assert np.nanmedian(np.abs(coarse - small[0].depth)) < 0.02


def test_one_thing_changes_and_the_common_point_is_measured_once(folder, monkeypatch):
    monkeypatch.setattr(growth, 'BASE', {'views': 2, 'categories': 10, 'objects': 3,
                                         'pixels': 0.25})
    asked = []
    grown = growth.grow(folder, axes={'views': (1, 2), 'categories': (2, 10)}, shares=(),
                        each=lambda rows: asked.extend(rows) or rows)
    assert len(asked) == 3 and grown['views'][1] is grown['categories'][1]
    assert [p.setting['views'] for p in grown['views']] == [1, 2]
    for points in grown.values():
        for p in points:
            assert p.cpu_s > 0 and p.peak_mb > 50 and p.standing == 3 and p.candidates > 0


def test_a_frame_set_that_follows_lacks_a_share_of_the_objects(folder, monkeypatch):
    monkeypatch.setattr(growth, 'BASE', {'views': 2, 'categories': 10, 'objects': 4,
                                         'pixels': 0.25})
    seen, taken = [], []
    parser = growth.Parser
    monkeypatch.setattr(parser, 'update', lambda self, views, last, seed: seen.append(
        (views, last)) or parser.parse(self, views, seed))
    without = growth.views_without
    monkeypatch.setattr(growth, 'views_without', lambda *args: taken.append(
        args[3]) or without(*args))
    points = growth.grow(folder, axes={'views': (2,)}, shares=(0.0, 0.5))[growth.CHANGED]
    assert [p.standing for p in points] == [4, 2] and all(p.cpu_s > 0 for p in points)
    # Both follow the same settled answer.
    assert seen[-1][1] is seen[-2][1] and seen[0][1] is None and seen[1][1] is not None
    assert len(taken[-1]) == 2 and not taken[-2]
    nearer = [(a.depth - b.depth)[a.depth < b.depth - 0.03].size
              for a, b in zip(seen[-2][0], seen[-1][0])]
    assert sum(nearer) > 30


def test_exponent_is_the_slope_of_the_logarithms():
    points = [SimpleNamespace(setting={'views': n}, cpu_s=3.0 * n ** 1.5) for n in (1, 2, 6)]
    assert growth.exponent(points, 'views', 'cpu_s') == pytest.approx(1.5)


def test_a_model_bound_to_a_rig_is_refused(folder):
    bound = SimpleNamespace(classifier={'kind': 0}, path='m', profile='paper')
    with pytest.raises(HoocError, match='trained for one rig'):
        growth.grow(bound)


def test_the_plot_is_written(tmp_path):
    points = [growth.Point({**growth.BASE, 'views': n}, 2.0 * n, 300.0, 20, 100, 18)
              for n in (1, 2)]
    growth.write_plot(tmp_path / 'a' / 'growth.png', {'views': points, growth.CHANGED: [
        growth.Point({**growth.BASE, growth.CHANGED: 0.1}, 0.5, 300.0, 18, 100, 16)]}, 'title')
    assert (tmp_path / 'a' / 'growth.png').read_bytes()[:4] == b'\x89PNG'

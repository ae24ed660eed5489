# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Stage 2 as the other stages see it: rows, sums, errors, determinism."""

from dataclasses import replace

from hooc_perception.core.classification import classify as module
from hooc_perception.core.classification.classify import classify, ClassifyConfig
from hooc_perception.core.classification.features import draw_probes, feature_count
from hooc_perception.core.classification.forest import Forest
from hooc_perception.core.classification.pixel_forest import PixelForest
from hooc_perception.errors import HoocError
import numba as nb
import numpy as np
import pytest

# One tree: higher than 5 cm is class 2, lower is class 1, with some doubt.
STUMP = Forest(np.array([0, -1, -1], np.int32), np.array([0.05, 0, 0], np.float32),
               np.array([1, 0, 0], np.int32), np.zeros(1, np.int32),
               np.array([0, 0, 1], np.int32), np.array([[0, 200, 55], [0, 55, 200]], np.uint8))


def head(kind):
    return {'kind': np.uint8(kind), 'version': np.uint8(1), 'classes': np.uint8(2)}


@pytest.fixture(scope='module')
def fused():
    return {**head(module.KIND_FUSED), 'probes': draw_probes(np.random.default_rng(0), 8),
            **STUMP.arrays('forest_')}


@pytest.fixture(scope='module')
def paper():
    # Each view's one test: is the scene 6 cm above the point, in the next view, farther?
    classifier = {**head(module.KIND_PAPER), 'views': np.uint8(3)}
    for i in range(3):
        forest = PixelForest(STUMP, np.array([(i + 1) % 3], np.uint8),
                             np.array([[0, -0.06, 0, 0]], np.float32))
        classifier.update(forest.arrays(f'view{i}_'))
    return classifier


@pytest.fixture(scope='module')
def scene(small):
    return small.observed([small.box([-0.15, 0, 0.1], [0.1, 0.1, 0.2]),
                           small.box([0.15, 0, 0.02], [0.16, 0.1, 0.04])])


@pytest.mark.parametrize('kind', ['fused', 'paper'])
def test_rows_are_the_foreground_pixels_and_sum_to_255(kind, scene, request):
    result = classify(scene, request.getfixturevalue(kind))
    assert result.p.dtype == np.uint8 and result.p.shape[1] == 3
    assert (result.p.sum(1, dtype=int) == 255).all()
    for i, view in enumerate(scene.views):
        mask = np.zeros_like(view.foreground)
        u, v = result.uv[result.camera == i].T
        mask[v, u] = True
        assert (mask == view.foreground).all() and len(u) == mask.sum()


def test_the_fused_forest_tells_high_from_low(scene, fused):
    for config in (ClassifyConfig(stride=1, smoothing_steps=0), ClassifyConfig(stride=3)):
        result = classify(scene, fused, config)
        best = result.p.argmax(1)
        points = [scene.views[c].depth[v, u] for c, (u, v) in zip(result.camera, result.uv)]
        assert np.isfinite(points).all()
        assert set(np.unique(best)) == {1, 2}
    exact = classify(scene, fused, ClassifyConfig(stride=1, smoothing_steps=0))
    from hooc_perception.core.classification.features import foreground_pixels
    z = foreground_pixels(scene).points[:, 2]
    assert ((exact.p.argmax(1) == 2) == (z.astype(np.float32) > np.float32(0.05))).all()


def test_any_number_of_views_serves_the_fused_forest(scene, fused):
    for n in (1, 2):
        part = replace(scene, views=scene.views[:n])
        assert set(np.unique(classify(part, fused).camera)) == set(range(n))


def test_the_paper_forest_is_bound_to_its_rig(scene, paper):
    with pytest.raises(HoocError, match='trained for 3 views, but there are 2'):
        classify(replace(scene, views=scene.views[:2]), paper)


@pytest.mark.parametrize('kind', ['fused', 'paper'])
def test_same_numbers_whatever_the_threads(kind, scene, request):
    classifier = request.getfixturevalue(kind)
    before = nb.get_num_threads()
    try:
        nb.set_num_threads(1)
        one = classify(scene, classifier).p
    finally:
        nb.set_num_threads(before)
    assert (one == classify(scene, classifier).p).all()


@pytest.mark.parametrize('kind', ['fused', 'paper'])
def test_an_empty_table_has_no_rows(kind, small, request):
    result = classify(small.observed([]), request.getfixturevalue(kind))
    assert result.p.shape == (0, 3) and result.uv.shape == (0, 2) and len(result.camera) == 0


def test_foreign_and_damaged_classifiers_are_refused(scene, fused):
    with pytest.raises(HoocError, match='train the model again'):
        classify(scene, {})
    with pytest.raises(HoocError, match='format 9'):
        classify(scene, {**fused, 'version': np.uint8(9)})
    with pytest.raises(HoocError, match='damaged'):
        classify(scene, {**fused, 'probes': np.zeros((3, 4))})
    beyond = np.array([feature_count(8), -1, -1], np.int32)
    with pytest.raises(HoocError, match='damaged'):
        classify(scene, {**fused, 'forest_feature': beyond})
    with pytest.raises(HoocError, match='classes'):
        classify(scene, {**fused, 'classes': np.uint8(7)})

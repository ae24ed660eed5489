# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The layout of the evidence: strides, pixel lists, hypotheses and what is left."""

from hooc_perception.core.frame.evidence import hypotheses_of
from hooc_perception.core.frame.kernels import compare as stat
from hooc_perception.core.frame.kernels.pixel_lists import PixelLists
from hooc_perception.core.frame.kernels.records import PixelWeights
from hooc_perception.core.hypotheses.propose import candidates_of
from hooc_perception.core.render import render_depth
from hooc_perception.core.types import Candidates
import numpy as np
import pytest

WEIGHTS = PixelWeights()


@pytest.fixture(scope='module')
def space(desk):
    """Return the desk's Frame."""
    return desk.frame


def test_views_are_laid_out_one_after_the_other(desk, space):
    evidence, views = space.evidence, desk.observation.views
    e = evidence.views
    np.testing.assert_array_equal(e.depth, np.concatenate([v.depth.ravel() for v in views]))
    np.testing.assert_array_equal(e.first, np.cumsum([0] + [v.depth.size for v in views]))
    np.testing.assert_array_equal(evidence.cost_none, np.concatenate(
        [v.foreground.ravel() for v in views]))
    np.testing.assert_array_equal(np.bincount(e.patch[e.patch >= 0]), e.patch_size)
    i = np.flatnonzero(e.p_row >= 0)
    listed = desk.probabilities
    np.testing.assert_array_equal(
        i, np.sort(e.first[listed.camera] + listed.uv[:, 1].astype(int) * 160 + listed.uv[:, 0]))


def test_a_stride_looks_at_every_second_pixel_of_the_same_picture(desk, space):
    H, shape = hypotheses_of(desk.truth, space.shapes), space.shapes.of(desk.truth)
    _, full = space.evidence.compare_pixels(H, shape, WEIGHTS)
    stats, half = space.coarse.compare_pixels(H, shape, WEIGHTS)
    for k in range(len(H)):
        shown = np.full(len(space.evidence.views.depth), np.inf, np.float32)
        mine = slice(*full.offsets[k:k + 2])
        shown[full.pixel[mine]] = full.depth[mine]
        every_second = np.concatenate(
            [shown[a:b].reshape(v.depth.shape)[::2, ::2].ravel() for a, b, v in
             zip(space.evidence.views.first, space.evidence.views.first[1:],
                 desk.observation.views)])
        mine = slice(*half.offsets[k:k + 2])
        np.testing.assert_array_equal(half.pixel[mine], np.flatnonzero(np.isfinite(every_second)))
        np.testing.assert_allclose(half.depth[mine], every_second[half.pixel[mine]], rtol=1e-6)
    assert (stats[:, stat.AGREE] > 50).all()


def test_composed_pictures_are_those_of_the_renderer(desk, space):
    H = hypotheses_of(desk.truth, space.shapes)
    _, lists = space.evidence.compare_pixels(H, space.shapes.of(desk.truth), WEIGHTS)
    owner, depth, *_ = space.evidence.compose([0, 1, 2], lists)
    drawn = [render_depth(desk.meshes, v.camera) for v in desk.observation.views]
    expected = np.concatenate([d.ravel() for d, _ in drawn])
    ids = np.concatenate([i.ravel() for _, i in drawn])
    # The lists leave out pixels without a reading.
    read = np.isfinite(space.evidence.views.depth)
    np.testing.assert_array_equal(np.isfinite(depth)[read], np.isfinite(expected)[read])
    both = read & np.isfinite(expected)
    np.testing.assert_allclose(depth[both], expected[both], rtol=1e-6)
    np.testing.assert_array_equal(owner[both], ids[both])
    assert np.isinf(depth[~read]).all()


def test_rows_of_pixel_lists_are_taken_and_joined():
    lists = PixelLists(np.array([0, 2, 2, 5]), np.arange(5), np.arange(5, dtype=np.float32),
                       -np.arange(5, dtype=np.float32))
    taken = lists.take(np.array([2, 0, 1]))
    assert taken.offsets.tolist() == [0, 3, 5, 5]
    assert taken.pixel.tolist() == [2, 3, 4, 0, 1]
    assert taken.depth.tolist() == [2, 3, 4, 0, 1]
    assert taken.cost.tolist() == [-2, -3, -4, 0, -1]
    none = lists.take(np.zeros(0, np.int64))
    assert none.offsets.tolist() == [0]
    joined = taken.extended(lists)
    assert joined.offsets.tolist() == [0, 3, 5, 5, 7, 7, 10]
    assert joined.pixel.tolist() == [2, 3, 4, 0, 1, 0, 1, 2, 3, 4]
    assert none.extended(lists).offsets.tolist() == lists.offsets.tolist()


def test_hypotheses_and_candidates_are_the_same_things(desk, space):
    H, shapes = hypotheses_of(desk.truth, space.shapes), space.shapes
    np.testing.assert_allclose(H[:, 7:10], 1, rtol=1e-6)
    H[:, 7:10] *= [[1.2, 0.8, 1.1]]
    back = candidates_of(H, shapes.of(desk.truth), np.arange(3.0), shapes)
    np.testing.assert_allclose(back.size, desk.truth.size * [[1.2, 0.8, 1.1]], rtol=1e-6)
    np.testing.assert_allclose(hypotheses_of(back, shapes), H, rtol=1e-6, atol=1e-12)
    np.testing.assert_array_equal(back.category, desk.truth.category)
    assert back.category.dtype == back.member.dtype == np.uint16
    assert back.size.dtype == np.float32
    assert back.score.dtype == np.float32 and back.translation.dtype == np.float64
    assert hypotheses_of(Candidates.empty(), shapes).shape == (0, 10)
    assert len(candidates_of(np.zeros((0, 11)), np.zeros(0, int), np.zeros(0), shapes)) == 0


def test_what_an_object_covers_is_no_longer_unexplained(desk, space):
    H = hypotheses_of(desk.truth, space.shapes)
    _, lists = space.evidence.compare_pixels(H, space.shapes.of(desk.truth), WEIGHTS)
    alone = space.evidence.unexplained()
    np.testing.assert_array_equal(alone, 1)
    left = space.evidence.unexplained(space.evidence.compose([0, 2], lists))
    on_ball = np.linalg.norm(space.cloud.points - desk.truth.translation[1], axis=1) < 0.06
    assert left[on_ball].mean() > 0.95
    assert left[~on_ball].mean() < 0.1
    assert space.evidence.unexplained(space.evidence.compose([0, 1, 2], lists)).mean() < 0.05


def test_nothing_is_asked_of_no_hypothesis(space):
    stats, lists = space.evidence.compare_pixels(np.zeros((0, 10)), np.zeros(0, int), WEIGHTS)
    assert stats.shape == (0, stat.STATS)
    assert lists.offsets.tolist() == [0]

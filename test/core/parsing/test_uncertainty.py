# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Sigmas know what the images leave open, and say when nothing can be said."""

from dataclasses import replace

from hooc_perception.core.frame.costs import ObjectCosts, PixelCosts
from hooc_perception.core.frame.frame import Frame
from hooc_perception.core.geometry import stage_rng
from hooc_perception.core.methods.joint import JointMethod
from hooc_perception.core.parsing.calibration import pixel_areas
from hooc_perception.core.parsing.uncertainty import _wider, pose_uncertainty
from hooc_perception.core.profiles import profile
from hooc_perception.core.types import Candidates, Energy, ParsedScene
from hooc_perception.parser import Parser
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

COSTS = PixelCosts(), ObjectCosts()


def answer(objects, residual_m=0.001, worth=1000.0):
    n = len(objects)
    some = np.ones(n, np.float32)
    return ParsedScene(objects, Energy(0, 0, 0), some, residual_m * some, worth * some,
                       np.full(n, 3, np.uint8), objects)


def sigmas(desk, objects=None, **kwargs):
    """Return (sigma_t, sigma_r) of true objects on a desk."""
    return pose_uncertainty(desk.frame, answer(desk.truth if objects is None else objects,
                                               **kwargs), *COSTS, stage_rng(0, 'sigmas'))


def test_plain_objects_in_full_view_are_known_to_millimetres(desk):
    sigma_t, sigma_r = sigmas(desk)
    assert sigma_t.dtype == sigma_r.dtype == np.float32
    assert ((sigma_t > 0.0005) & (sigma_t < 0.006)).all()
    # Box, ball, can: a ball has no orientation, a can's is that of its axis.
    assert np.isnan(sigma_r[1])
    assert 0 < sigma_r[0] < 0.15 and 0 < sigma_r[2] < 0.15


def test_same_seed_same_sigmas(desk):
    np.testing.assert_array_equal(sigmas(desk), sigmas(desk))


def test_larger_residuals_make_less_sure(desk):
    small, large = sigmas(desk, residual_m=0.002), sigmas(desk, residual_m=0.006)
    assert (large[0] > small[0]).all() and (large[1] > 1.3 * small[1])[[0, 2]].all()


def test_one_view_knows_less_than_three(desk, make_desk):
    one = replace(desk.observation, views=desk.observation.views[:1])
    mine = desk.probabilities.camera == 0
    p = replace(desk.probabilities, **{name: getattr(desk.probabilities, name)[mine]
                                       for name in ('camera', 'uv', 'p')})
    alone = pose_uncertainty(Frame(one, p, desk.models), answer(desk.truth), *COSTS,
                             stage_rng(0, 'sigmas'))
    known = sigmas(desk)
    assert (alone[0] > known[0]).all() and (alone[1] > 1.2 * known[1])[[0, 2]].all()


def test_a_half_turn_that_looks_the_same_is_told(make_desk, things):
    """A box is called a thing without symmetries: nobody can tell its front from its back."""
    plain = tuple(replace(m, symmetry=np.ones(3, np.int32)) if m.name == 'box' else m
                  for m in things)
    truth = Candidates(np.array([1], np.uint16), np.array([[0, 0, 0.03]]),
                       np.array([[0, 0, 0, 1.0]]), np.float32([things[0].extents]),
                       np.ones(1, np.float32))
    desk = make_desk(truth)
    turned, known = (
        pose_uncertainty(Frame(desk.observation, desk.probabilities, models), answer(truth),
                         *COSTS, stage_rng(0, 'sigmas')) for models in (plain, things))
    assert turned[1, 0] == pytest.approx(np.pi) and known[1, 0] < 0.2


def test_the_mixture_quantile():
    # Of flips that never come within the radius, and of the rest as if Gaussian.
    rng = np.random.default_rng(0)
    for p in (0.0, 0.1, 0.25):
        local = np.linalg.norm(rng.normal(size=(100000, 3)), axis=1) / np.sqrt(chi2.ppf(0.68, 3))
        error = np.where(rng.random(len(local)) < p, np.pi * 10, local)
        assert (error < _wider(p)).mean() == pytest.approx(0.68, abs=0.01)


def test_nothing_and_scenes_without_anything(desk, empty_desk):
    none = sigmas(desk, Candidates.empty())
    assert none.shape == (2, 0)
    # An object where nobody measured anything: the prior is all that is known.
    sigma_t, _ = sigmas(empty_desk, desk.truth)
    assert np.isfinite(sigma_t).all()


def test_scores_are_probabilities_of_what_an_object_is_worth(desk):
    scores = []
    for worth in (-5.0, 0.0, 10.0, 98.0, 1000.0, 1e5):
        done = JointMethod().calibrate(desk.frame, answer(desk.truth, worth=worth))
        scores.append(done.objects.score)
    scores = np.array(scores)
    assert scores.dtype == np.float32 and (np.diff(scores[1:], axis=0) > 0).all()
    assert (scores >= 0).all() and (scores <= 1).all() and (scores[0] < 0.01).all()
    # Pixels of the reference camera: 98 of them mean that an object stands there half of the time.
    area = pixel_areas(desk.truth, desk.observation.views)
    even = JointMethod().calibrate(desk.frame, answer(desk.truth, worth=1.0))
    expected = 1 / (1 + np.exp(4.04 - 0.88 * np.log(area)))
    np.testing.assert_allclose(even.objects.score, expected, rtol=1e-5)


def test_pixels_of_other_cameras_are_converted(desk):
    sharp = [replace(v, camera=replace(v.camera, K=v.camera.K * [[2], [2], [1]]))
             for v in desk.observation.views]
    ratio = (pixel_areas(desk.truth, desk.observation.views)
             / pixel_areas(desk.truth, tuple(sharp)))
    np.testing.assert_allclose(ratio, 4)


def test_the_papers_scores_are_left_alone_and_orientations_are_not(desk):
    turns = Rotation.from_rotvec([[0, 0, np.pi], [0, 0, 0.9], [0, 0, 1.2]])
    turned = replace(desk.truth, rotation_xyzw=(
        Rotation.from_quat(desk.truth.rotation_xyzw) * turns).as_quat())
    paper = Parser(desk.models, {}, profile('paper'))
    paper.method.parse = lambda *_: answer(turned)
    done = paper.decide(desk.frame, turned)
    np.testing.assert_array_equal(done.objects.score, turned.score)
    angles = Rotation.from_quat(done.objects.rotation_xyzw).magnitude()
    np.testing.assert_allclose(angles, [0.4, 0, 0], atol=1e-6)


def test_with_sigmas_fills_the_record(desk):
    parser = Parser(desk.models, {}, sigmas=True)
    parser.method.parse = lambda *_: answer(desk.truth)
    done = parser.decide(desk.frame, desk.truth)
    np.testing.assert_array_equal(done.sigma_t, sigmas(desk)[0])
    assert answer(desk.truth).sigma_t is None

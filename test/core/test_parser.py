# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The public API: the whole chain in one process, with a classifier that knows the truth."""

from dataclasses import replace
import json
from pathlib import Path
import subprocess
import sys

import hooc_perception
from hooc_perception import Camera, DepthView, Parser, Scene
from hooc_perception import parser as parser_module
from hooc_perception.core.frame.costs import PixelCosts
from hooc_perception.core.frame.frame import Frame
from hooc_perception.core.geometry import stage_rng
from hooc_perception.core.hypotheses.propose import propose, propose_more
from hooc_perception.core.parsing.calibration import calibrated_scores
from hooc_perception.core.parsing.config import ParseConfig
from hooc_perception.core.parsing.search import search_scene
from hooc_perception.core.profiles import profile
from hooc_perception.core.segment.observe import observe
from hooc_perception.core.segment.rectify import rectify
from hooc_perception.core.symmetry import canonical_objects
from hooc_perception.errors import HoocError
from hooc_perception.io.bags.reader import BagScene
import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
SAME = ('category', 'translation', 'rotation_xyzw', 'size', 'score')


@pytest.fixture
def oracle(desk, monkeypatch):
    """Put the true classes in the place of a classifier; return the calls it got."""
    calls = []

    def classify(observation, classifier, config):
        calls.append((observation, classifier, config))
        return desk.probabilities

    monkeypatch.setattr(parser_module, 'classify', classify)
    return calls


@pytest.fixture
def small_profile(cheap):
    """Return a profile for three things."""
    return replace(profile('best'), propose=cheap, parse=ParseConfig(rounds=1))


def test_from_depth_images_to_the_objects(desk, oracle, small_profile):
    scene = Parser(list(desk.models), {'known': 1}, small_profile).parse(desk.views)
    found = sorted(scene.objects, key=lambda o: desk.models.index(
        next(m for m in desk.models if m.name == o.category)))
    assert [o.category for o in found] == [m.name for m in desk.models]
    off = np.linalg.norm([o.translation for o in found] - desk.truth.translation, axis=1)
    assert off.max() < 0.008
    assert set(scene.seconds) == {'observe', 'classify', 'propose', 'parse'}
    assert all(s >= 0 for s in scene.seconds.values())
    (observation, classifier, config), = oracle
    assert len(observation.views) == 3
    assert classifier == {'known': 1}
    assert config == small_profile.classify


def test_the_chain_is_the_stages_one_after_the_other(desk, oracle, small_profile):
    """What separate processes do that seed themselves: the same to the last bit."""
    scene = Parser(desk.models, {}, small_profile).parse(desk.views, seed=5)
    p, costs = small_profile, PixelCosts()

    def seen():
        observation = observe([rectify(v, p.observe) for v in desk.views], p.observe)
        return Frame(observation, desk.probabilities, desk.models)

    pool = propose(seen(), p.propose, costs, stage_rng(5, 'propose'))

    def more(objects, turn):
        return propose_more(seen(), objects, p.propose, costs, stage_rng(5, 'propose', turn))

    search, _, considered = search_scene(seen(), pool, p.parse, stage_rng(5, 'parse'), 0, more)
    order = np.arange(len(search.chosen))
    for name in SAME[1:4]:
        np.testing.assert_array_equal(
            getattr(scene.parsed.objects, name),
            getattr(canonical_objects(search.chosen, desk.models).take(order), name))
    for name in SAME:
        np.testing.assert_array_equal(getattr(scene.parsed.pool, name), getattr(considered, name))
    np.testing.assert_array_equal(scene.parsed.energy_delta,
                                  search.marginal_energies().astype(np.float32))
    np.testing.assert_array_equal(scene.parsed.objects.score,
                                  calibrated_scores(scene.parsed, seen().observation))


def test_a_parser_keeps_nothing_from_scene_to_scene(desk, empty_desk, oracle, small_profile,
                                                    monkeypatch):
    parser = Parser(desk.models, {}, small_profile)
    first = parser.parse(desk.views).parsed
    with monkeypatch.context() as m:
        m.setattr(parser_module, 'classify', lambda *_: empty_desk.probabilities)
        nothing = parser.parse(empty_desk.views)
    again = parser.parse(desk.views).parsed
    assert len(nothing.objects) == len(nothing.parsed.pool) == 0
    for name in SAME:
        np.testing.assert_array_equal(getattr(first.objects, name), getattr(again.objects, name))


def test_the_pool_can_be_changed_between_the_stages(desk, oracle, small_profile):
    seen = []

    def only_truth(pool):
        seen.append(len(pool))
        return desk.truth.take([1])

    alone = replace(small_profile, parse=ParseConfig(rounds=0, polish_steps=0))
    scene = Parser(desk.models, {}, alone).parse(desk.views, change_pool=only_truth)
    assert seen[0] > 3
    np.testing.assert_array_equal(scene.parsed.objects.translation, desk.truth.translation[[1]])


@pytest.mark.parametrize('limit, expected', [(0, 2), (1, 1), (2, 2)])
def test_the_limit_of_instances_reaches_the_search(desk, oracle, small_profile, limit, expected):
    # A ball drawn out to the box's size explains the box, as long as nothing better is there.
    other = replace(desk.truth.take([0]), category=np.array([2], np.uint16))
    pool = desk.truth.take([1]).extended(other)
    alone = replace(small_profile, parse=ParseConfig(rounds=0, polish_steps=0))
    parser = Parser(desk.models, {}, alone, max_instances=limit)
    assert len(parser.parse(desk.views, change_pool=lambda _: pool).objects) == expected


def test_other_seeds_draw_other_numbers(desk, oracle, small_profile):
    parser = Parser(desk.models, {}, small_profile)
    a, b, c = (parser.propose(desk.frame, seed) for seed in (0, 0, 1))
    np.testing.assert_array_equal(a.translation, b.translation)
    assert len(a) != len(c) or (a.translation != c.translation).any()


def test_what_a_stage_refuses_passes_through(desk, oracle, small_profile):
    parser = Parser(desk.models, {}, small_profile)
    with pytest.raises(HoocError, match='at least one camera'):
        parser.parse([])
    blind = [replace(v, depth=np.zeros_like(v.depth)) for v in desk.views]
    with pytest.raises(HoocError, match='camera0'):
        parser.parse(blind)


def test_an_untrained_classifier_is_named(desk, small_profile):
    with pytest.raises(HoocError, match='train the model again'):
        Parser(desk.models, {}, small_profile).parse(desk.views)


def test_parameters_that_the_papers_forest_does_not_have_are_refused(desk):
    paper = {'kind': np.uint8(0)}
    chosen = replace(profile('best'), classify=replace(profile('best').classify, stride=4))
    with pytest.raises(HoocError, match='classify.stride has no effect'):
        Parser(desk.models, paper, chosen)
    Parser(desk.models, paper, profile('fast'))


@pytest.fixture(scope='module')
def demo():
    """Return (Parser of the bundled model, raw views of the bundled scene, Scene)."""
    parser = Parser.load(ROOT / 'models' / 'demo')
    views = BagScene(ROOT / 'bags' / 'demo').views()
    return parser, views, parser.parse(views)


def test_the_example_of_the_docstring(demo):
    parser, views, scene = demo
    assert isinstance(scene, Scene) and isinstance(views[0], DepthView)
    assert isinstance(views[0].camera, Camera)
    assert len(scene.objects) >= 8 and scene.converged
    for o in scene.objects:
        assert 0 <= o.score <= 1 and o.n_views <= len(views)
        assert o.T_world_object.shape == (4, 4)
        np.testing.assert_array_equal(o.T_world_object[:3, 3], o.translation)
        assert 0 < o.sigma_t < 0.2
    assert 'sigmas' in scene.seconds


def test_a_scene_as_plain_data(demo):
    scene = demo[2]
    content = json.loads(json.dumps(scene.to_dict(), allow_nan=False))
    assert [o['category'] for o in content['objects']] == [o.category for o in scene.objects]
    assert content['energy']['total'] == scene.energy.total
    assert content['objects'][0]['translation'] == scene.objects[0].translation.tolist()
    assert 'parsed' not in repr(scene)


def test_a_scene_as_arrays(demo):
    scene = demo[2]
    meshes = scene.meshes()
    assert len(meshes) == len(scene.objects)
    for (vertices, faces), o in zip(meshes, scene.objects):
        assert faces.max() < len(vertices)
        centre = (vertices - o.translation) @ o.T_world_object[:3, :3]
        np.testing.assert_allclose(np.ptp(centre, axis=0), o.size, rtol=1e-5)
    view = scene.observation.views[0]
    depth, ids = scene.depth(view.camera)
    shown = np.isfinite(depth) & view.foreground
    assert (np.abs(depth - view.depth)[shown] < 0.02).mean() > 0.7
    assert ids.max() < len(meshes) and ((ids >= 0) == np.isfinite(depth)).all()
    left = scene.unexplained()
    assert len(left) < 0.4 * sum(v.foreground.sum() for v in scene.observation.views)


def test_the_package_imports_nothing_until_it_is_used():
    code = ('import sys, hooc_perception; '
            "print([m for m in ('numpy', 'numba', 'scipy', 'rclpy') if m in sys.modules]); "
            'from hooc_perception import Parser; '
            "print([m for m in ('rclpy', 'open3d', 'mujoco', 'pyrender') if m in sys.modules])")
    done = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True, cwd=ROOT)
    assert done.stdout.split('\n')[:2] == ['[]', '[]'], done.stdout + done.stderr
    assert set(hooc_perception.__all__) <= set(dir(hooc_perception))
    assert hooc_perception.__version__
    with pytest.raises(AttributeError, match='no attribute'):
        hooc_perception.Praser  # noqa: B018

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Setting B: which candidates make room for the true poses."""

from pathlib import Path

from hooc_perception.core.classification.classify import classify
from hooc_perception.core.frame.frame import Frame
from hooc_perception.core.methods.joint import JointMethod
from hooc_perception.core.profiles import profile
from hooc_perception.core.segment.observe import observe
from hooc_perception.core.segment.rectify import rectify
from hooc_perception.core.types import Candidates, PixelProbabilities
from hooc_perception.evaluation.matching import posed
from hooc_perception.evaluation.scores import score_scene
from hooc_perception.evaluation.stages import as_candidates, as_objects, true_classes
from hooc_perception.evaluation.true_poses import with_true_poses
from hooc_perception.io.bags.reader import BagScene
from hooc_perception.io.scenes.scene import TrueObject
from hooc_perception.objects.derive import derive
from hooc_perception.trained.folder import load_model_folder
import numpy as np
import pytest
import trimesh

ROOT = Path(__file__).resolve().parents[2]


def true_object(category, x):
    """Return a TrueObject at (x, 0, 0.1)."""
    return TrueObject(category, np.array([x, 0, 0.1]), np.array([0, 0, 0.6, 0.8]),
                      np.array([0.1, 0.2, 0.3]))


@pytest.fixture
def ordered(models):
    """Return the GenericModels: class ids 1 ball, 2 box, 3 can."""
    assert list(models) == ['ball', 'box', 'can']
    return tuple(models.values())


def pool_of(*rows):
    """Return Candidates from (class id, score); the row's number is its x."""
    category, score = zip(*rows)
    n = len(rows)
    translation = np.zeros((n, 3))
    translation[:, 0] = np.arange(n)
    return Candidates(np.array(category, np.uint16), translation, np.tile([0, 0, 0, 1.0], (n, 1)),
                      np.full((n, 3), 0.1, np.float32), np.array(score, np.float32))


def test_the_worst_of_each_true_category_makes_room(ordered):
    pool = pool_of((1, 0.9), (1, 0.2), (1, 0.5), (2, 0.1), (3, 0.3), (3, 0.4))
    changed = with_true_poses([true_object('ball', 7.0), true_object('can', 8.0)], ordered)(pool)
    # Rows 1 (ball, .2) and 4 (can, .3) are gone, the box's only candidate is not.
    assert changed.translation[:, 0].tolist() == [0, 2, 3, 5, 7, 8]
    assert changed.category.tolist() == [1, 1, 2, 3, 1, 3]
    np.testing.assert_allclose(changed.rotation_xyzw[-2:], [[0, 0, 0.6, 0.8]] * 2)
    np.testing.assert_allclose(changed.size[-2:], [[0.1, 0.2, 0.3]] * 2, rtol=1e-6)
    assert len(pool) == 6
    for name in ('category', 'translation', 'rotation_xyzw', 'size', 'score'):
        assert getattr(changed, name).dtype == getattr(pool, name).dtype


def test_two_of_a_category_take_two_places(ordered):
    pool = pool_of((1, 0.9), (1, 0.2), (1, 0.5))
    truth = [true_object('ball', 7.0), true_object('ball', 8.0)]
    changed = with_true_poses(truth, ordered)(pool)
    assert changed.translation[:, 0].tolist() == [0, 7, 8]


def test_a_category_without_candidates_gains_one(ordered):
    pool = pool_of((1, 0.9))
    truth = [true_object('can', 7.0), true_object('ball', 8.0), true_object('ball', 9.0)]
    changed = with_true_poses(truth, ordered)(pool)
    assert changed.translation[:, 0].tolist() == [7, 8, 9]
    assert changed.category.tolist() == [3, 1, 1]
    alone = with_true_poses(truth, ordered)(Candidates.empty())
    assert alone.translation[:, 0].tolist() == [7, 8, 9]


def test_no_truth_changes_nothing_and_unknown_categories_are_left_out(ordered):
    pool = pool_of((1, 0.9), (2, 0.1))
    for truth in ([], [true_object('teapot', 7.0)]):
        assert with_true_poses(truth, ordered)(pool).translation[:, 0].tolist() == [0, 1]


def unsure_probabilities(observation, truths, models):
    """Return probabilities that give the true class of a pixel a half, the others the rest."""
    rng, parts, classes = np.random.default_rng(0), [], len(models) + 1
    for j, view in enumerate(observation.views):
        v, u = np.nonzero(view.foreground)
        p = 0.5 * rng.dirichlet(np.ones(classes), len(u))
        true = true_classes(truths, models, view)[v, u]
        p[np.arange(len(u)), np.maximum(true, 0)] += 0.5
        parts.append((np.full(len(u), j, np.uint8), np.stack([u, v], 1).astype(np.uint16),
                      np.rint(255 * p).astype(np.uint8)))
    return PixelProbabilities(*(np.concatenate(x) for x in zip(*parts)))


class Alone(JointMethod):
    """The joint method without re-proposal."""

    def propose_more(self, frame, objects, turn, seed):
        return Candidates.empty()


def method_of(name):
    """Return the method of a profile; whatever it parses, it proposes nothing itself."""
    chosen = profile(name)
    return chosen.method() if name == 'paper' else Alone(chosen.propose, chosen.parse)


def answer_of(name, observation, probabilities, truths, models):
    """Return the SceneScore of a profile's parsing that knows only the true poses."""
    only_true = as_candidates(truths, models)
    frame = Frame(observation, probabilities, tuple(models))
    parsed = method_of(name).parse(frame, only_true, 0, 1)
    return score_scene('scene', as_objects(parsed.objects, models), truths,
                       {m.name: m for m in models})


@pytest.mark.parametrize('name', ['paper', 'best', 'fast'])
def test_with_only_true_poses_every_object_is_found(name, models, tiny, posed_truths):
    rng = np.random.default_rng(0)
    derived = tuple(derive(m.name, trimesh.Trimesh(m.vertices, m.faces), rng)
                    for m in models.values())
    for scene in tiny.scenes[:2]:
        truths = posed_truths[scene.name]
        observation = observe([rectify(view) for view in scene.depth()])
        probabilities = unsure_probabilities(observation, truths, derived)
        score = answer_of(name, observation, probabilities, truths, derived)
        assert (score.found, score.localized, score.tight) == (1, 1, 1)
        assert score.estimated == len(truths)


@pytest.mark.parametrize('name', ['best', 'fast'])
def test_with_only_true_poses_all_ten_of_the_bundled_scene_are_found(name):
    # Other shapes than the generic models, sensor noise, and what a small forest makes of it.
    scene, folder = BagScene(ROOT / 'bags' / 'demo'), load_model_folder(ROOT / 'models' / 'demo')
    observation = observe([rectify(view) for view in scene.views()])
    probabilities = classify(observation, folder.classifier)
    score = answer_of(name, observation, probabilities, [posed(t) for t in scene.truth],
                      folder.models)
    assert (score.found, score.localized, score.estimated) == (1, 1, 10)

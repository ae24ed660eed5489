# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What the stages lose, with a chain whose every stage is known."""

from types import SimpleNamespace

from hooc_perception.core.segment.config import ObserveConfig
from hooc_perception.core.segment.observe import observe
from hooc_perception.core.segment.rectify import rectify
from hooc_perception.core.types import Energy, PixelProbabilities
from hooc_perception.evaluation import rerun as rerun_module
from hooc_perception.evaluation.paper_tables import energy_table
from hooc_perception.evaluation.stage_tables import stage_category_table, stage_table
from hooc_perception.evaluation.stages import as_candidates, true_classes
from hooc_perception.evaluation.tables import to_text
from hooc_perception.objects.derive import derive
import numpy as np
import pytest
import trimesh


@pytest.fixture
def folder(models):
    """Return what stands in for a ModelFolder: derived models and nothing learnt."""
    rng = np.random.default_rng(0)
    derived = tuple(derive(m.name, trimesh.Trimesh(m.vertices, m.faces), rng)
                    for m in models.values())
    return SimpleNamespace(models=derived, classifier={}, profile='best', seed=0,
                           max_instances=1)


@pytest.fixture
def chain(monkeypatch, folder, posed_truths, tiny):
    """Put a chain in place that classifies perfectly and finds all objects but the first."""
    scenes = {scene.name: scene for scene in tiny.scenes}

    def name_of(depth):
        return next(name for name, scene in scenes.items()
                    if np.array_equal(scene.depth()[0].depth, depth, equal_nan=True))

    class Perfect:
        """Stands in for a Parser: knows all classes and poses, leaves out the first object."""

        models, profile = folder.models, SimpleNamespace(observe=ObserveConfig())

        @classmethod
        def load(cls, loaded, profile, sigmas):
            assert loaded is folder and profile is None and not sigmas
            return cls()

        def observe(self, views):
            return observe([rectify(view) for view in views])

        def classify(self, observation):
            truths, parts = posed_truths[name_of(observation.views[0].depth)], []
            for j, view in enumerate(observation.views):
                v, u = np.nonzero(view.foreground)
                p = np.zeros((len(u), len(folder.models) + 1), np.uint8)
                p[np.arange(len(u)),
                  np.maximum(true_classes(truths, folder.models, view)[v, u], 0)] = 255
                parts.append((np.full(len(u), j, np.uint8),
                              np.stack([u, v], 1).astype(np.uint16), p))
            return PixelProbabilities(*(np.concatenate(x) for x in zip(*parts)))

        def parse(self, views, seed):
            assert seed == folder.seed
            pool = as_candidates(posed_truths[name_of(views[0].depth)], self.models)
            return SimpleNamespace(parsed=SimpleNamespace(
                pool=pool, objects=pool.take(np.arange(1, len(pool))),
                energy=Energy(0.1, 0.2, 0.3), seconds={'parse': 0.5}))

    monkeypatch.setattr(rerun_module, 'Parser', Perfect)


def test_losses_are_where_the_chain_loses(chain, tiny, folder):
    energies, losses = rerun_module.rerun(tiny, folder, True)
    assert set(energies) == set(losses) == {'10_1', '10_2'}
    for name, n in (('10_1', 3), ('10_2', 2)):
        loss = losses[name]
        assert loss['pixels']['accuracy'] == 1
        assert loss['pool'].pool_tight == loss['pool'].first_localized == 1
        assert loss['pool'].kept == pytest.approx((n - 1) / n)
        assert loss['answer'].localized == pytest.approx((n - 1) / n)
        # Depth is rendered from the truth, and every pixel has its class.
        assert energies[name].depth < 0.05 and energies[name].probability < 0.05
    assert 'ranked 1st' in to_text(stage_table(losses))
    rows = {row[0]: row for row in stage_category_table(losses, list(tiny.category_names)).rows}
    # The chain leaves out the first object of either scene: the ball, and one of two boxes.
    assert {name: (row[1], row[4], row[-1]) for name, row in rows.items()} == {
        'ball': (1, 1, 0), 'box': (2, 2, 1), 'can': (2, 2, 2)}
    assert [row[0] for row in stage_category_table(losses, list(tiny.category_names)).rows] == [
        'ball', 'box', 'can']
    assert all(row[2] > 50 and row[3] == 1 for row in rows.values())


def test_energy_of_the_truth_alone(chain, tiny, folder):
    energies, losses = rerun_module.rerun(tiny, folder)
    assert losses == {} and len(energies) == 2
    text = to_text(energy_table([], energies))
    assert 'truth total' in text and 'needs the classifier' not in text


def test_for_report(chain, tiny, folder):
    again = rerun_module.Rerun(folder)
    views = tiny.scene('10_1').depth()
    assert set(again.for_report(views)) == {'probabilities', 'config'}
    assert len(again.for_report(views, True)['pool']) == 3

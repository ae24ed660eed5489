# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Mask scores: known masks, and the scorer beside the repository."""

from dataclasses import replace
import json
import subprocess
import sys

from hooc_perception.core.geometry import back_project
from hooc_perception.evaluation.evaluate import evaluate_results, scoring_models
from hooc_perception.evaluation.masks import match_masks
from hooc_perception.io.scenes.scene_set import load_scene_set
import numpy as np
import pytest


def test_iou_of_known_rectangles():
    labels, ids = np.zeros((60, 60), np.uint8), np.full((60, 60), -1)
    labels[0:20, 0:20], labels[40:60, 40:60] = 3, 7
    labels[30:33, 0:3] = 9  # too small to count
    ids[0:20, 10:30], ids[40:60, 40:60] = 0, 2
    valid = np.ones_like(labels, bool)
    values, partner, iou = match_masks(ids, 3, labels, valid)
    assert values == [3, 7]
    np.testing.assert_array_equal(partner, [0, 2])
    np.testing.assert_allclose(iou, [200 / 600, 1])
    valid[:, 20:30] = False
    np.testing.assert_allclose(match_masks(ids, 3, labels, valid)[2], [200 / 400, 1])


def test_one_mask_explains_one_label_only():
    labels, ids = np.zeros((40, 40), np.uint8), np.full((40, 40), -1)
    labels[:20], labels[20:] = 1, 2
    ids[:] = 0
    values, partner, iou = match_masks(ids, 1, labels, np.ones_like(labels, bool))
    assert sorted(partner) == [-1, 0] and sorted(iou) == [0, 0.5]


def test_no_estimates():
    labels = np.ones((40, 40), np.uint8)
    values, partner, iou = match_masks(np.full((40, 40), -1), 0, labels, labels > 0)
    assert values == [1] and list(partner) == [-1] and list(iou) == [0]


def test_masks_are_those_of_the_mesh_that_was_found(tiny, models, truth_results):
    entry = next(e for e in truth_results['scenes'] if e['scene'] == 'labelled')
    can = next(o for o in entry['objects'] if o['category'] == 'can')
    can['category'] = 'ball'
    families = {**models, 'ball': replace(models['ball'], variants=(models['can'],))}

    def worst_iou(member, known):
        can['member'] = member
        return min(evaluate_results(tiny, truth_results, known).masks[0].iou)

    assert worst_iou(0, families) < 0.9 and worst_iou(1, families) > 0.99
    # Without that mesh the generic one is drawn.
    assert worst_iou(1, models) == worst_iou(0, models)


def test_models_have_the_variants_of_the_set_or_of_the_model(tiny, models):
    ball, box, can = tiny.categories
    family = replace(box, variant_paths=(can.mesh_path,), scale=0.5)
    scene_set = replace(tiny, categories=(ball, family))
    own = scoring_models(scene_set)
    assert own['ball'].variants == ()
    np.testing.assert_allclose(own['box'].variants[0].extents, models['can'].extents / 2)
    variants = (models['ball'], models['can'])
    trained = scoring_models(scene_set, trained=[replace(models['box'], variants=variants)])
    assert trained['box'].variants == variants and trained['ball'].variants == ()
    np.testing.assert_allclose(trained['box'].extents, models['box'].extents / 2)


def test_agrees_with_the_independent_scorer(shared_scenes, tmp_path):
    scorer = shared_scenes.parent / 'tools' / 'score_labels.py'
    if not scorer.is_file():
        pytest.skip('no independent scorer beside the repository')
    scene_set = load_scene_set(shared_scenes / 'osd')
    rng, scenes = np.random.default_rng(1), []
    for scene in scene_set.scenes[:-1]:
        (view,) = scene.depth()
        labels = scene.labels()[view.camera.name]
        points, objects = back_project(view.depth, view.camera), []
        for value in np.unique(labels[labels > 0]):
            mine = points[(labels == value) & np.isfinite(view.depth)]
            low, high = np.percentile(mine, [5, 95], axis=0)
            centre = (low + high) / 2 + rng.normal(0, 0.015, 3)
            objects.append({'category': str(rng.choice(scene_set.category_names)), 'score': 1.0,
                            'translation': centre.tolist(), 'rotation_xyzw': [0, 0, 0, 1],
                            'size': np.maximum(high - low, 0.02).tolist()})
        scenes.append({'scene': scene.name, 'seconds': 1.0, 'objects': objects})
    results = {'format': 'hooc-results/1', 'dataset': 'osd', 'scenes': scenes}
    (tmp_path / 'r.json').write_text(json.dumps(results))
    out = subprocess.run([sys.executable, scorer, scene_set.path, tmp_path / 'r.json'],
                         capture_output=True, text=True, check=True).stdout.splitlines()
    masks = evaluate_results(scene_set, results, scoring_models(scene_set)).masks
    assert len(out) == len(masks) + 1
    for line, m in zip(out, masks):
        name, _, share, _, n = line.split()
        assert (name, share, int(n)) == (m.name, f'{m.explained}/{m.labelled}', m.estimated)
    assert 0 < sum(m.explained for m in masks) < sum(m.labelled for m in masks)

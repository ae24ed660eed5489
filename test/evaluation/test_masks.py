# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Mask scores: known masks, and the scorer beside the repository."""

import ast
from dataclasses import replace
import json
import re
import shutil
import subprocess
import sys

from hooc_perception.cli.main import main
from hooc_perception.core.geometry import back_project
from hooc_perception.evaluation.evaluate import evaluate_results, scoring_models
from hooc_perception.evaluation.masks import countable, matched, overlaps
from hooc_perception.evaluation.named_masks import named_score, NamedScore, summary
from hooc_perception.io.scenes.scene_set import load_scene_set
import numpy as np
import pytest


def test_iou_of_known_rectangles():
    labels, ids = np.zeros((60, 60), np.uint8), np.full((60, 60), -1)
    labels[0:20, 0:20], labels[40:60, 40:60] = 3, 7
    labels[30:33, 0:3] = 9  # too small to count
    ids[0:20, 10:30], ids[40:60, 40:60] = 0, 2
    valid = np.ones_like(labels, bool)
    values = countable(labels, valid, False)
    assert values == [3, 7]
    partner, iou = matched(overlaps(ids, 3, labels, values, valid))
    np.testing.assert_array_equal(partner, [0, 2])
    np.testing.assert_allclose(iou, [200 / 600, 1])
    valid[:, 20:30] = False
    np.testing.assert_allclose(matched(overlaps(ids, 3, labels, values, valid))[1],
                               [200 / 400, 1])


def test_what_was_not_measured_counts_only_where_no_category_is_known():
    labels, valid = np.zeros((60, 60), np.uint8), np.ones((60, 60), bool)
    labels[:10, :15], labels[20:40, :10] = 1, 2
    assert countable(labels, valid, True) == [1, 2] and countable(labels, valid, False) == [2]
    valid[20:26] = False
    assert countable(labels, valid, True) == [1] and countable(labels, valid, False) == [2]


def test_one_mask_explains_one_label_only():
    labels = np.zeros((40, 40), np.uint8)
    labels[:20], labels[20:] = 1, 2
    partner, iou = matched(overlaps(np.zeros((40, 40), int), 1, labels, [1, 2], labels > 0))
    assert sorted(partner) == [-1, 0] and sorted(iou) == [0, 0.5]


def test_no_estimates():
    labels = np.ones((40, 40), np.uint8)
    partner, iou = matched(overlaps(np.full((40, 40), -1), 0, labels, [1], labels > 0))
    assert list(partner) == [-1] and list(iou) == [0]


def test_objects_are_named_by_an_estimate_of_their_own_category():
    #               can   box   can  pen
    iou = np.array([[.6, .0, .35, .0],      # can, twice: named once
                    [.0, .31, .0, .0],      # box, not explained but named
                    [.2, .0, .55, .0],      # cup, taken for a can
                    [.0, .0, .0, .0]])      # not noted, not seen
    score = named_score(iou, ['can', 'box', 'cup', None], [True, True, True, False],
                        ['can', None, 'can', None], ['can', 'box', 'can', 'pen'],
                        [400, 300, 500, 60])
    assert [label.named for label in score.labels] == [True, True, False, False]
    assert score.false == ('pen',) and score.shown == 4
    hidden = named_score(iou, ['can', 'box', 'cup', None], [True] * 4, [None] * 4,
                         ['can', 'box', 'can', 'pen'], [400, 300, 500, 59])
    assert hidden.false == () and hidden.shown == 3
    # Two labels of a category and one estimate: only one is named.
    twice = named_score(np.array([[.4], [.5]]), ['can', 'can'], [True] * 2, ['can', None], ['can'],
                        [90])
    assert [label.named for label in twice.labels] == [False, True]
    figures = summary([score, NamedScore()])
    assert figures['well_seen'] == {'labelled': 3, 'explained': 2 / 3, 'named': 2 / 3}
    assert figures['all'] == {'labelled': 4, 'explained': 0.5, 'named': 0.5}
    assert (figures['scenes'], figures['false'], figures['shown']) == (2, 0.5, 2)
    assert figures['categories'] == {'can': {'labelled': 1, 'named': 1},
                                     'box': {'labelled': 1, 'named': 1},
                                     'cup': {'labelled': 1, 'named': 0}}
    assert figures['taken_for'] == [{'category': 'cup', 'taken_for': 'can', 'count': 1}]
    assert figures['false_categories'] == {'pen': 1}


def test_nothing_labelled_and_nothing_found():
    assert summary([]) is None
    empty = named_score(np.zeros((0, 2)), [], [], [], ['can', 'pen'], [70, 10])
    assert empty.false == ('can',) and empty.shown == 1
    figures = summary([empty, named_score(np.zeros((1, 0)), ['can'], [False], [None], [], [])])
    assert figures['well_seen'] == {'labelled': 0, 'explained': None, 'named': None}
    # Nobody noted what is well seen: categories are of all labels.
    assert figures['categories'] == {'can': {'labelled': 1, 'named': 0}}


def test_a_labelled_scene_is_scored_by_category(tiny_path, truth_results, tmp_path, capsys):
    folder = shutil.copytree(tiny_path, tmp_path / 'set')
    (folder / 'scenes/labelled/labels.yaml').write_text('1: ball\n2: box\n3: can\n')
    (folder / 'scenes/labelled/well_seen.yaml').write_text('left: [1, 3]\n')
    entry = next(e for e in truth_results['scenes'] if e['scene'] == 'labelled')
    can = next(o for o in entry['objects'] if o['category'] == 'can')
    entry['objects'].append(can | {'translation': [0.0, 0.25, 0.06]})
    can['category'] = 'box'
    (tmp_path / 'r.json').write_text(json.dumps(truth_results))
    main(['evaluate', str(folder), str(tmp_path / 'r.json'), '--json', str(tmp_path / 's.json')])
    out = capsys.readouterr().out
    assert 'Named objects' in out and 'Named by category: r' in out
    figures = json.loads((tmp_path / 's.json').read_text())['results'][0]['named']
    assert figures['well_seen'] == {'labelled': 2, 'explained': 1, 'named': 0.5}
    assert figures['all'] == {'labelled': 3, 'explained': 1, 'named': pytest.approx(2 / 3)}
    assert figures['taken_for'] == [{'category': 'can', 'taken_for': 'box', 'count': 1}]
    assert (figures['false'], figures['shown'], figures['false_categories']) == (1, 4, {'can': 1})
    table = out[out.index('Named by category: r'):].splitlines()
    row = next(line for line in table if line.startswith('can '))
    assert row.split() == ['can', '1', '0', '0.00', '1', 'box', '1']


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


def guesses(scene_set, seed, right=0.0):
    """Return results with a box of readings for each label, of the right category now and then."""
    rng, scenes = np.random.default_rng(seed), []
    for scene in scene_set.scenes[:-1]:
        views, objects = {view.camera.name: view for view in scene.depth()}, []
        (camera, labels), = scene.labels().items()
        points = back_project(views[camera].depth, views[camera].camera)
        for value in np.unique(labels[labels > 0]):
            mine = points[(labels == value) & np.isfinite(views[camera].depth)]
            if not len(mine):
                continue
            low, high = np.percentile(mine, [5, 95], axis=0)
            centre = (low + high) / 2 + rng.normal(0, 0.015, 3)
            category = str(rng.choice(scene_set.category_names))
            if rng.random() < right:
                category = scene.label_categories[int(value)]
            objects.append({'category': category, 'score': 1.0,
                            'translation': centre.tolist(), 'rotation_xyzw': [0, 0, 0, 1],
                            'size': np.maximum(high - low, 0.02).tolist()})
        scenes.append({'scene': scene.name, 'seconds': 1.0, 'objects': objects})
    return {'format': 'hooc-results/1', 'dataset': scene_set.name, 'scenes': scenes}


def independent(shared_scenes, tool, scene_set, results, folder):
    """Return what a scorer beside the repository prints; skip where there is none."""
    scorer = shared_scenes.parent / 'tools' / tool
    if not scorer.is_file():
        pytest.skip('no independent scorer beside the repository')
    (folder / 'r.json').write_text(json.dumps(results))
    return subprocess.run([sys.executable, scorer, scene_set.path, folder / 'r.json'],
                          capture_output=True, text=True, check=True).stdout.splitlines()


def test_agrees_with_the_independent_scorer(shared_scenes, tmp_path):
    scene_set = load_scene_set(shared_scenes / 'osd')
    results = guesses(scene_set, 1)
    out = independent(shared_scenes, 'score_labels.py', scene_set, results, tmp_path)
    masks = evaluate_results(scene_set, results, scoring_models(scene_set)).masks
    assert len(out) == len(masks) + 1
    for line, m in zip(out, masks):
        name, _, share, _, n = line.split()
        assert (name, share, int(n)) == (m.name, f'{m.explained}/{m.labelled}', m.estimated)
    assert 0 < sum(m.explained for m in masks) < sum(m.labelled for m in masks)


def test_agrees_with_the_independent_scorer_of_named_objects(shared_scenes, tmp_path):
    if not (shared_scenes / 'hots').is_dir():
        pytest.skip('no set with categories of its labels beside the repository')
    scene_set = load_scene_set(shared_scenes / 'hots')
    results = guesses(scene_set, 2, right=0.6)
    *rows, mistaken, false, total = independent(shared_scenes, 'score_real.py', scene_set, results,
                                                tmp_path)
    ours = evaluate_results(scene_set, results, scoring_models(scene_set)).named
    shares = [f'{ours[group][key]:.3f}' for group in ('well_seen', 'all')
              for key in ('explained', 'named')]
    found = re.fullmatch(
        r'well seen (\d+): explained (\S+) named (\S+) \| all (\d+): explained (\S+) named (\S+) '
        r'\| false a scene (\S+) of (\S+) seconds \S+', total).groups()
    assert [*found[1:3], *found[4:6]] == shares
    assert (int(found[0]), int(found[3])) == (ours['well_seen']['labelled'],
                                              ours['all']['labelled'])
    assert found[6:] == (f'{ours["false"]:.2f}', f'{ours["shown"]:.1f}')
    assert {row.split()[0]: row.split()[2] for row in rows} == {
        name: f'{count["named"]}/{count["labelled"]}'
        for name, count in ours['categories'].items()}
    # Both lists say how often, for the twelve most frequent; which of equals come last is open.
    theirs = dict(ast.literal_eval(mistaken.removeprefix('taken for: ')))
    mine = {(m['category'], m['taken_for']): m['count'] for m in ours['taken_for']}
    assert theirs and all(mine[pair] == count for pair, count in theirs.items())
    theirs = dict(ast.literal_eval(false.removeprefix('false: ')))
    assert theirs and all(ours['false_categories'][name] == n for name, n in theirs.items())
    assert 0 < ours['well_seen']['named'] < 1 and 0 < ours['well_seen']['explained'] < 1

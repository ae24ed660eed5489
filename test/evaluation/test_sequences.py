# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Scores of sequences: hand-made cases, the command, and the scorer beside the repository."""

from dataclasses import replace
import json
import re
import subprocess
import sys

from hooc_perception.cli.main import main
from hooc_perception.evaluation.evaluate import evaluate_results, scoring_models
from hooc_perception.evaluation.matching import posed
from hooc_perception.evaluation.scores import score_scene
from hooc_perception.evaluation.sequences import Frame, sequence_score, summary, tables_of
from hooc_perception.io.scenes.scene_set import (
    load_scene_set,
    NewScene,
    TrueObject,
    write_scene_set,
)
from hooc_perception.io.scenes.sequences import RecordedSequence
import numpy as np
import pytest
import yaml

EVENTS = {2: 'removed can', 4: 'moved box', 6: 'placed can', 8: 'arm in', 10: 'arm out'}


def true(category, x, seen=0.5):
    return TrueObject(category, np.array([x, 0, 0.0]), np.array([0, 0, 0, 1.0]),
                      np.full(3, 0.1), seen)


def told(category, x, number=None):
    return replace(posed(true(category, x)), id=number)


def truth_at(k):
    """Return the true objects of frame set k: the box moves, the can goes and comes back."""
    box = true('box', 0.0 if k < 4 else 0.3)
    return [box] if 2 <= k < 6 else [box, true('can', 0.6)]


def truth_told(k):
    """Return the truth of frame set k as estimates; their ids are 1 and 2."""
    return [told(t.category, t.translation[0], 1 + (t.category == 'can')) for t in truth_at(k)]


@pytest.fixture
def score(models):
    """Return a function: estimates per frame set, changed ones by index -> SequenceScore."""
    def scored(changed, events=None, truth=None, count=12):
        frames = []
        for k in range(count):
            estimates = changed.get(k, truth_told(k))
            here = (truth or {}).get(k, truth_at(k))
            frames.append(Frame(score_scene(f's_{k}', estimates, [posed(t) for t in here],
                                            models, k + 1.0), here, estimates))
        return sequence_score(RecordedSequence('s', 0.5, tuple(f.score.name for f in frames),
                                               EVENTS if events is None else events),
                              frames, models)
    return scored


def test_the_truth_is_right_at_once_and_steady(score):
    s = score({})
    assert [(c.frame, c.what, c.after) for c in s.changes] == [
        (2, 'removed can', 0), (4, 'moved box', 0), (6, 'placed can', 0)]
    assert all((f.localized, f.false_categories) == (1, 0) for f in s.frames)
    # Pairs that end in 1, 3, 5, 7 and 11 are still; 9 and 11 follow on what the arm does.
    assert s.flicker == (0,) * 4 and s.jitter_m == (0,) * 6 and s.switches == 0
    m = summary([s])
    assert (m['localized'], m['changes'], m['right'], m['at_once']) == (1, 3, 3, 3)
    assert (m['flicker'], m['jitter_m'], m['jumps'], m['id_switches']) == (0, 0, 0, 0)
    assert m['seconds_median'] == 6.5 and m['seconds_p95'] == pytest.approx(11.45)


def test_changes_that_are_told_late_or_never(score):
    # The can is told one frame set too long, the moved box stays where it was until it is too
    # late, and the placed can is within 6 cm in the second frame set that shows it.
    s = score({2: [told('box', 0), told('can', 0.6)],
               4: [told('box', 0.21)], 5: [told('box', 0.215)],
               6: [told('box', 0.3), told('can', 0.665)],
               7: [told('box', 0.3), told('can', 0.655)]})
    assert [c.after for c in s.changes] == [1, None, 1]
    m = summary([s, s])
    assert (m['changes'], m['right'], m['at_once']) == (6, 4, 0)
    assert m['false_categories'] == pytest.approx(1 / 12)


def test_a_removed_object_may_be_told_elsewhere(score):
    assert score({2: [told('box', 0), told('can', 0.661)]}).changes[0].after == 0
    assert score({2: [told('box', 0), told('can', 0.659)]}).changes[0].after == 1


def test_flicker_and_jitter_are_of_still_pairs(score):
    s = score({1: [told('box', 0.03), told('ball', 0.9)], 3: [], 9: [], 10: [], 11: []})
    # 0 to 1: the box stays, can and ball are told once; 2 to 3: the box is gone.
    assert s.flicker == pytest.approx([2 / 3, 1, 0, 0])
    assert sorted(s.jitter_m) == pytest.approx([0, 0, 0, 0.03])
    assert summary([s])['jumps'] == 0.25
    # Nothing told in either says nothing.
    assert score(dict.fromkeys(range(12), [])).flicker == ()


def test_two_of_a_category_do_not_flicker(score):
    assert score({1: [told('box', 0), told('box', 0.5), told('can', 0.6)]}).flicker[0] == 0


def test_hidden_objects_do_not_count(score):
    truth = {k: [true('box', 0.3, 0.149), true('can', 0.6, 0.15)] for k in (8, 9)}
    s = score({8: [told('can', 0.6)], 9: []}, truth=truth)
    assert s.frames[8].localized == 1 and s.frames[9].localized == 0
    assert summary([score({}, {}, {0: [true('box', 0, 0.1)]}, 2)])['localized'] == 1
    unknown = {0: [replace(true('box', 0), surface_visibility=None)]}
    assert score({0: []}, {}, unknown, 1).frames[0].localized == 0


def test_id_switches_are_of_localized_objects(score):
    swapped = [told('box', 0, 2), told('can', 0.6, 1)]
    far = [told('box', 0.2, 9), told('can', 0.6, 2)]
    assert score({1: swapped}, {}, count=2).switches == 2
    # There and back; an object that is elsewhere, missing or without an id keeps its last one.
    assert score({1: swapped}, {}, count=2 + 1).switches == 3
    assert score({1: far}, {}, count=2).switches == 0
    gone = {1: [], 2: [told('box', 0), told('can', 0.6, 5)]}
    assert score(gone, {}, {2: truth_at(0)}, 3).switches == 1
    nameless = score(dict.fromkeys(range(2), [told('box', 0)]), {}, count=2)
    assert nameless.switches is None and summary([nameless])['id_switches'] is None
    assert summary([score({1: swapped}, {}, count=2), nameless])['id_switches'] == 50


def test_tables_show_results_side_by_side(score):
    late = {2: [told('box', 0), told('can', 0.6)]}
    figures, changes = tables_of([('one', summary([score({})])), ('two', summary([score(late)]))])
    assert [row[:2] + row[3:5] for row in figures.rows] == [('one', '1.000', '3/3', 3),
                                                           ('two', '1.000', '3/3', 2)]
    assert changes.rows[0] == ('s 2: removed can', 0, 1)
    never = summary([score({4: [], 5: []})])
    assert tables_of([('three', never)])[1].rows[1] == ('s 4: moved box', 'never')
    assert len(tables_of([('still', summary([score({}, {}, count=2)]))])) == 1
    assert tables_of([]) == []


@pytest.fixture(scope='module')
def moving(tiny, tmp_path_factory):
    """Return the folder of a set with a sequence of twelve frame sets and a single scene."""
    meshes = {c.name: trimesh_of(c.mesh_path) for c in tiny.categories}
    depth = tiny.scenes[0].depth()
    path = write_scene_set(
        tmp_path_factory.mktemp('moving') / 'set', 'moving', meshes, tiny.cameras,
        [NewScene(name, tuple(view.depth for view in depth), tuple(truth_at(k)))
         for k, name in enumerate([*(f's_{k:02d}' for k in range(12)), 'single'])], 1)
    (path / 'sequences.yaml').write_text(yaml.safe_dump([
        {'name': 's', 'period_s': 0.5, 'scenes': [f's_{k:02d}' for k in range(12)],
         'events': EVENTS}]))
    return path


def trimesh_of(path):
    import trimesh
    return trimesh.load(path, force='mesh')


def spoilt_truth(scene_set, rng, ids=True):
    """Return results that are partly right, for comparing scorers; one scene is missing."""
    scenes, removed = [], []
    for scene in scene_set.scenes:
        objects = []
        # What was there last time may still be told.
        for thing in (*scene.truth, *(removed if rng.random() < 0.3 else ())):
            if rng.random() < 0.15:
                continue
            away = rng.normal(0, 0.03, 3) * rng.random()
            category = (str(rng.choice(scene_set.category_names)) if rng.random() < 0.05
                        else thing.category)
            objects.append({'category': category, 'score': 1.0, 'size': thing.size.tolist(),
                            'translation': (thing.translation + away).tolist(),
                            'rotation_xyzw': thing.rotation_xyzw.tolist()})
            if ids and rng.random() < 0.9:
                objects[-1]['id'] = int(rng.integers(0, 3))
        removed = scene.truth
        scenes.append({'scene': scene.name, 'seconds': rng.random(), 'objects': objects})
    scenes.pop(3)
    return {'format': 'hooc-results/1', 'dataset': scene_set.name, 'scenes': scenes}


def test_evaluate_prints_and_writes_the_scores(moving, tmp_path, capsys):
    scene_set = load_scene_set(moving)
    for name, seed in (('one', 0), ('two', 1)):
        (tmp_path / f'{name}.json').write_text(json.dumps(
            spoilt_truth(scene_set, np.random.default_rng(seed), seed == 0)))
    files = [str(tmp_path / 'one.json'), str(tmp_path / 'two.json')]
    assert main(['evaluate', str(moving), *files, '--json', str(tmp_path / 'scores.json')]) == 0
    out = capsys.readouterr().out
    assert '\nSequences\n' in out and 's 4: moved box' in out
    one, two = json.loads((tmp_path / 'scores.json').read_text())['results']
    found, = one['sequences']['sequences']
    assert found['name'] == 's' and found['frames'][3]['seconds'] is None
    assert [frame['scene'] for frame in found['frames']] == [f's_{k:02d}' for k in range(12)]
    assert one['sequences']['id_switches'] > 0 and two['sequences']['id_switches'] is None
    # A part of a sequence has no such scores.
    assert main(['evaluate', str(moving), files[0], '--scene', 's_00', '--scene', 'single']) == 0
    assert '\nSequences\n' not in capsys.readouterr().out


@pytest.mark.parametrize('name, seed', [('small', 0), ('small', 1), ('small', 2), ('moves', 0)])
def test_agrees_with_the_independent_scorer(shared_scenes, moving, tmp_path, name, seed):
    scorer = shared_scenes.parent / 'tools' / 'score_sequence.py'
    if not scorer.is_file():
        pytest.skip('no independent scorer beside the repository')
    path = moving if name == 'small' else shared_scenes / name
    if not path.is_dir():
        pytest.skip(f'no set {name} beside the repository')
    scene_set = load_scene_set(path)
    results = spoilt_truth(scene_set, np.random.default_rng(seed))
    (tmp_path / 'r.json').write_text(json.dumps(results))
    *lines, last = subprocess.run([sys.executable, scorer, path, tmp_path / 'r.json'], check=True,
                                  capture_output=True, text=True).stdout.splitlines()
    scores = evaluate_results(scene_set, results, scoring_models(scene_set)).sequences
    changes = [change for s in scores for change in s.changes]
    assert [int(n[1]) if (n := re.search(r'after (\d+) further', line)) else None
            for line in lines] == [change.after for change in changes]
    m = summary(scores)
    assert last == (
        f'localized {m["localized"]:.3f} false {m["false_categories"]:.2f} changes right '
        f'{m["right"]}/{m["changes"]} (at once {m["at_once"]}) flicker {m["flicker"]:.3f} jitter '
        f'median {1000 * m["jitter_m"]:.1f} mm, over 2 cm {m["jumps"]:.3f} id switches per 100 '
        f'updates {m["id_switches"]:.1f} seconds median {m["seconds_median"]:.2f} p95 '
        f'{m["seconds_p95"]:.2f}')
    assert 0.1 < m['localized'] < 0.95 and m['jumps'] > 0 and m['id_switches'] > 0

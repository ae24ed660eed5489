# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Which scenes are the worst, why their objects were missed, and the picture of them."""

from dataclasses import replace
import json

from hooc_perception.cli.main import main
from hooc_perception.core.render import render_depth
from hooc_perception.errors import HoocError
from hooc_perception.evaluation.evaluate import evaluate_results
from hooc_perception.evaluation.worst import (
    pools_of,
    read_pools,
    worst_json,
    worst_scenes,
    worst_table,
)
from hooc_perception.evaluation.worst_sheet import draw_sheet, MISSED, RIGHT, write_worst
from matplotlib.colors import to_rgb
import numpy as np
from PIL import Image
import pytest


@pytest.fixture
def judged(tiny, models, posed_truths):
    """Return a function ({scene: [PosedObject]}, pools) -> [WorstScene] of the whole set."""
    def judge(changed, pools=None, n=9):
        answers = posed_truths | changed
        results = {'scenes': [
            {'scene': name, 'seconds': 1.0, 'objects': [
                {'category': o.category, 'translation': o.translation, 'size': o.size,
                 'rotation_xyzw': o.rotation_xyzw} for o in objects]}
            for name, objects in answers.items()]}
        return worst_scenes(tiny, evaluate_results(tiny, results, models, 'x'), models, n, pools)

    return judge


def why(scene):
    """Return {category: texts} of what was missed."""
    return {m.category: m.why for m in scene.missed}


def test_the_scene_of_which_less_was_localized_comes_first(judged, posed_truths):
    scenes = judged({'10_2': posed_truths['10_2'][:1]})
    assert [s.name for s in scenes] == ['10_2', '10_1']
    assert [s.localized for s in scenes] == [0.5, 1.0]
    assert why(scenes[1]) == {} and scenes[1].wrong == ()
    assert [s.name for s in judged({'10_2': []}, n=1)] == ['10_2']


def test_one_in_the_place_of_another_is_named(judged, posed_truths):
    ball, box, can = posed_truths['10_1']
    scene, = judged({'10_1': [box, replace(ball, translation=can.translation)]}, n=1)
    metres = np.linalg.norm(ball.translation - can.translation)
    assert why(scene)['can'] == ('taken for ball',)
    assert why(scene)['ball'] == (f'found {100 * metres:.0f} cm away',)
    assert scene.wrong == (1,)


def test_one_that_a_right_one_covers_is_told_from_one_that_is_taken_for_another(judged,
                                                                                posed_truths):
    box, _ = posed_truths['10_2']
    # Still within half a box of the true centre, and as high as the can that stands on it.
    tall = replace(box, translation=box.translation + [0, 0, 0.06], size=box.size + [0, 0, 0.12])
    scene, = judged({'10_2': [tall]}, n=1)
    assert why(scene) == {'can': ('covered by box',)} and scene.wrong == ()


def test_the_pool_says_whether_there_was_a_candidate(judged, posed_truths):
    pools = {'10_1': {'ball': [True], 'can': [False]}}
    scene, = judged({'10_1': posed_truths['10_1'][1:2]}, pools, n=1)
    assert why(scene) == {'ball': ('candidate there, not chosen',), 'can': ('no candidate',)}


def test_pools_keep_the_order_of_the_truth_within_a_category(tmp_path):
    objects = [{'category': c, 'near': near} for c, near in
               (('can', True), ('box', False), ('can', False))]
    stages = {'one': {'pool': {'objects': objects}}}
    assert pools_of(stages) == {'one': {'can': [True, False], 'box': [False]}}
    path = tmp_path / 'scores.json'
    path.write_text(json.dumps({'stages': stages}))
    assert read_pools(path) == pools_of(stages)
    path.write_text(json.dumps({'stages': {}}))
    with pytest.raises(HoocError, match='scores.json'):
        read_pools(path)


def test_pixels_are_counted_over_all_views(judged, posed_truths, make_mesh, tiny):
    scene, = judged({'10_2': []}, n=1)
    meshes = [make_mesh(t) for t in posed_truths['10_2']]
    cameras = tiny.scenes[1].cameras
    shown = sum((render_depth(meshes, c)[1] == 0).sum() for c in cameras)
    alone = sum((render_depth(meshes[:1], c)[1] == 0).sum() for c in cameras)
    assert (scene.missed[0].pixels, scene.missed[0].visible) == (shown, shown / alone)
    assert shown < alone


def test_few_pixels_and_little_to_see_are_told(judged, posed_truths, monkeypatch):
    from hooc_perception.evaluation import worst
    monkeypatch.setattr(worst, 'HIDDEN', 1.0)
    monkeypatch.setattr(worst, 'FEW_PIXELS', 10 ** 6)
    scene, = judged({'10_2': []}, n=1)
    box = scene.missed[0]
    assert box.why == (f'few pixels ({box.pixels})', f'visible share {box.visible:.2f}')
    assert why(scene)['can'] == (f'few pixels ({scene.missed[1].pixels})',)


def test_the_table_has_a_row_for_each_that_was_missed(judged, posed_truths):
    ball, box, can = posed_truths['10_1']
    scenes = judged({'10_1': [box, replace(ball, translation=can.translation)]})
    content = json.loads(json.dumps(worst_json('x', scenes)))
    rows = worst_table(content).rows
    assert [row[:3] for row in rows] == [('10_1', '0.33', 'ball'), ('', '', 'can'),
                                         ('10_2', '1.00', None)]
    assert rows[0][-1] == 'ball' and rows[1][3] == 'taken for ball'


def coloured(path, colour):
    """Return the number of pixels of exactly this colour."""
    image = np.asarray(Image.open(path).convert('RGB')).astype(int)
    return int((abs(image - 255 * np.array(to_rgb(colour))).max(-1) < 2).sum())


def test_the_picture_shows_what_was_missed_in_red(judged, posed_truths, models, tmp_path):
    good, bad = judged({}), judged({'10_1': [], '10_2': []})
    draw_sheet(good, models, tmp_path / 'good.png')
    draw_sheet(bad, models, tmp_path / 'bad.png')
    # The legend has both colours in both.
    assert coloured(tmp_path / 'bad.png', MISSED) > coloured(tmp_path / 'good.png', MISSED) + 100
    assert coloured(tmp_path / 'bad.png', RIGHT) < coloured(tmp_path / 'good.png', RIGHT)


def test_what_no_view_shows_is_drawn_where_it_would_be(judged, posed_truths, models, tmp_path):
    box, can = posed_truths['10_2']
    scene, = judged({'10_2': []}, n=1)
    inside = replace(can, translation=box.translation, size=can.size * 0.3)
    for name, missed in (('hidden', scene.missed[1:]), ('none', ())):
        write_worst(tmp_path / name, 'x', [replace(scene, truths=(box, inside), missed=missed)],
                    models)
    # Dots around the can inside the box, and its name.
    more, less = (coloured(tmp_path / name / 'worst.png', MISSED) for name in ('hidden', 'none'))
    assert more > less + 50


def test_the_command_writes_picture_and_reasons(tiny_path, truth_results, tmp_path, capsys):
    truth_results['scenes'][0]['objects'].pop()
    (tmp_path / 'r.json').write_text(json.dumps(truth_results))
    stages = {'10_1': {'pool': {'objects': [{'category': 'can', 'near': False}]}}}
    (tmp_path / 's.json').write_text(json.dumps({'stages': stages}))
    assert main(['worst', str(tiny_path), str(tmp_path / 'r.json'), '--count', '2', '--out',
                 str(tmp_path / 'p'), '--stages', str(tmp_path / 's.json')]) == 0
    assert 'The worst scenes of `r`' in capsys.readouterr().out
    content = json.loads((tmp_path / 'p' / 'worst.json').read_text())
    first = content['scenes'][0]
    assert first['scene'] == '10_1' and first['missed'][0]['why'] == ['no candidate']
    assert 'no candidate' in (tmp_path / 'p' / 'worst.md').read_text()
    assert min(Image.open(tmp_path / 'p' / 'worst.png').size) > 300


def test_scenes_without_poses_have_no_worst(tiny_path, truth_results, tmp_path, capsys):
    (tmp_path / 'r.json').write_text(json.dumps(truth_results))
    assert main(['worst', str(tiny_path), str(tmp_path / 'r.json'), '--scene', 'labelled',
                 '--count', '2', '--out', str(tmp_path / 'p')]) == 1
    assert 'true poses' in capsys.readouterr().err
    assert main(['worst', str(tiny_path), str(tmp_path / 'r.json'), '--count', '0', '--out',
                 str(tmp_path / 'p')]) == 1
    assert '--count' in capsys.readouterr().err

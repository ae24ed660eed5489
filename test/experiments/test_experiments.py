# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Which steps run again and which do not, and what the pages show."""

from pathlib import Path
import shutil

from hooc_perception.cli.main import main as hooc
from hooc_perception.core.profiles import profile
from hooc_perception.errors import HoocError
from hooc_perception.experiments import experiment_tables, fingerprint, page, plan, run
from hooc_perception.experiments.__main__ import main
from hooc_perception.experiments.ablations import SWITCHES
import pytest


def quiet(*arguments, **options):
    """Run steps without a word."""
    return run.run(*arguments, **options, say=lambda text: None)


def test_the_plan_runs_in_its_order(tmp_path, scene_set):
    steps = plan.steps_of({'twin': None, 'small': scene_set}, tmp_path)
    made = {scene_set}
    for step in steps:
        assert set(step.inputs) <= made, step.name
        made.add(step.output)
    names = [step.name for step in steps]
    assert len(set(names)) == len(names)
    # Two rows of baselines with two steps, three profiles with five and two of them with one more
    # without the verifier, two steps per switch, two of pictures, and the twin.
    assert len(names) == 2 * (2 * 2 + 3 * 5 + 2 + 2 * len(SWITCHES) + 2) + 1


def test_shapes_are_a_set_of_their_own_model_with_fewer_rows(tmp_path, scene_set):
    def rows(*asked):
        steps = plan.steps_of({'shapes': scene_set, 'other': scene_set}, tmp_path, asked or None)
        return {name: {s.row for s in steps if s.name.startswith(f'{name}/')} - {'plots'}
                for name in ('shapes', 'other')}

    assert rows() == {'shapes': {'best', 'fast'}, 'other': set(plan.ROWS)}
    assert rows('paper') == {'shapes': {'paper'}, 'other': {'paper'}}
    names = [s.name for s in plan.steps_of({'shapes': scene_set}, tmp_path, ('best', 'paper'))]
    assert names == [*(f'shapes/paper/{w}' for w in ('train', 'A', 'B', 'scores', 'stages')),
                     *(f'shapes/best/{w}' for w in ('train', 'A', 'B', 'B_no_verifier', 'scores',
                                                    'stages')),
                     'shapes/plots', 'shapes/worst']


@pytest.fixture
def moving(scene_set, tmp_path):
    """Return the folder of the small set with its scene as a sequence."""
    path = shutil.copytree(scene_set, tmp_path / 'moving')
    (path / 'sequences.yaml').write_text('- {name: s, scenes: [one], events: {0: placed can}}')
    return path


def test_a_set_with_sequences_has_answers_to_every_frame_set_only(tmp_path, moving, scene_set):
    def names(*rows):
        return [s.name for s in plan.steps_of({'moves': moving}, tmp_path, rows or None)]

    best, on = ([f'moves/{row}/{what}' for what in ('A', 'scores')]
                for row in ('best', 'incremental'))
    assert names() == names('incremental') == ['moves/best/train', *best, *on]
    assert names('best') == ['moves/best/train', *best]
    once, again = (s for s in plan.steps_of({'moves': moving}, tmp_path) if s.name.endswith('/A'))
    assert again.arguments[:-2] == (*once.arguments[:-2], '--incremental')
    assert again.inputs == once.inputs and again.output != once.output
    # Other sets have no such row, and none that it would need.
    assert plan.steps_of({'small': scene_set, 'twin': None}, tmp_path, ('incremental',)) == []


def test_the_page_of_a_set_with_sequences_shows_how_they_went(tmp_path, moving, write_scores):
    root = tmp_path / 'results'
    for row, shift in (('best', 0.0), ('incremental', 0.07)):
        answer = plan.Layout(write_scores(row, shift), 'small').results(row, 'A')
        assert hooc(['evaluate', str(moving), str(answer), '--json',
                     str(plan.Layout(root, 'moves').scores(row))]) == 0
    sections = page.sections_of(root, ['moves'], {})
    assert set(sections) == {'moves'}
    text = sections['moves']
    assert [row[:4] for row in cells(text, '`best`') + cells(text, '`incremental`')] == [
        ['best', '1.000', '0.00', '1/1'], ['incremental', '0.500', '0.00', '0/1']]
    assert cells(text, 's 0: placed can') == [['s 0: placed can', '0', 'never']]


def test_hots_is_trained_among_strangers(tmp_path, scene_set):
    steps = {s.name: s for s in plan.steps_of({'hots': scene_set, 'glassware': scene_set},
                                              tmp_path)}
    rows = {name.rpartition('/')[0] for name in steps if name.endswith('/train')}
    assert rows == {f'{name}/{row}' for name in ('hots', 'glassware') for row in ('best', 'fast')}
    assert [name for name, s in steps.items() if '--strangers' in s.arguments] == [
        'hots/best/train', 'hots/fast/train']


def test_labels_with_categories_have_tables_of_their_own():
    named = {'well_seen': {'labelled': 4, 'explained': 0.75, 'named': 0.5},
             'all': {'labelled': 8, 'explained': 0.5, 'named': 0.25}, 'scenes': 2, 'false': 1.5,
             'shown': 5.0, 'categories': {'cup': {'labelled': 4, 'named': 2}},
             'taken_for': [{'category': 'cup', 'taken_for': 'can', 'count': 1}],
             'false_categories': {'can': 3}}
    masks = [{'name': 'a', 'explained': 4, 'labelled': 8, 'estimated': 5, 'iou': [0.5]}]
    scores = {'best': {'results': [{'setting': 'A', 'masks': masks, 'named': named}]},
              'fast': {'results': [{'setting': 'A', 'masks': masks}]}}
    tables = experiment_tables.summary_of('hots', {}, scores, {}, {})
    assert [t.title for t in tables] == ['Explained masks', 'Named objects',
                                         'Named by category: `best`']
    assert tables[1].rows == (('`best`', 4, '0.750', '0.500', 8, '0.500', '0.250', 1.5, '5.0'),)
    assert tables[2].rows == (('cup', 4, 2, 0.5, 0, 'can 1'), ('can', 0, 0, None, 3, None))


def test_setting_b_without_the_verifier_is_b_with_one_parameter_changed(tmp_path, scene_set):
    steps = {s.name: s for s in plan.steps_of({'shapes': scene_set}, tmp_path, ('best',))}
    plain, less = (steps[f'shapes/best/{w}'] for w in ('B', 'B_no_verifier'))
    assert less.arguments[:-2] == (*plain.arguments[:-2], '--set-parameter',
                                   'parse.verify_weight=0')
    assert plan.VERIFIED == tuple(
        p for p in plan.PROFILES if 'verify_weight' in profile(p).stage('parse').values())
    assert plain.inputs == less.inputs and less.output in steps['shapes/best/scores'].inputs


@pytest.mark.parametrize('sets, rows, word', [
    ({'elsewhere': None}, ('best',), 'elsewhere'), ({'twin': None}, ('good',), 'good')])
def test_unknown_sets_and_rows_are_named(tmp_path, sets, rows, word):
    with pytest.raises(HoocError, match=word):
        plan.steps_of(sets, tmp_path, rows)


def test_every_command_of_the_plan_exists(tmp_path, scene_set):
    import argparse
    import importlib
    for step in plan.steps_of({'twin': None, 'small': scene_set}, tmp_path):
        command, *arguments = map(str, step.arguments)
        parser = argparse.ArgumentParser(exit_on_error=False)
        importlib.import_module(f'hooc_perception.cli.{command}').add_arguments(parser)
        parser.parse_args(arguments)


def test_what_is_done_is_not_done_again(tmp_path, ran):
    steps = plan.steps_of({'twin': None}, tmp_path, ('best', 'ppf'))
    quiet(steps, tmp_path)
    assert ran == [step.name for step in steps]
    ran.clear()
    quiet(steps, tmp_path)
    assert ran == []


def test_a_lost_file_is_made_again_and_only_what_depends_on_it(tmp_path, ran):
    steps = plan.steps_of({'twin': None}, tmp_path, ('best', 'ppf'))
    quiet(steps, tmp_path)
    ran.clear()
    layout = plan.Layout(tmp_path, 'twin')
    layout.results('best', 'A').unlink()
    quiet(steps, tmp_path)
    # It came out as before, so what reads it has nothing new.
    assert ran == ['twin/best/A']
    ran.clear()
    (layout.model('best') / 'file').write_text('another model')
    quiet(steps, tmp_path)
    assert ran == ['twin/best/A', 'twin/best/B', 'twin/best/B_no_verifier', 'twin/best/scores',
                   'twin/best/stages']


def test_changed_code_runs_its_rows_again_but_for_those_that_are_kept(tmp_path, ran,
                                                                      monkeypatch):
    steps = plan.steps_of({'twin': None}, tmp_path, ('best', 'ppf'))
    quiet(steps, tmp_path)
    ran.clear()
    plain = fingerprint.of_code
    monkeypatch.setattr(fingerprint, 'of_code', lambda roots: plain(roots) + (
        'new' if 'hooc_perception.parser' in roots or 'evaluation.baselines' in roots[0]
        else ''))
    quiet(steps, tmp_path, keep=('ppf',))
    assert ran == ['twin/best/A', 'twin/best/B', 'twin/best/B_no_verifier']
    ran.clear()
    quiet(steps, tmp_path)
    assert ran == ['twin/ppf/A']


def test_force_runs_a_row_and_a_dry_run_nothing(tmp_path, ran):
    steps = plan.steps_of({'twin': None}, tmp_path, ('fast', 'ppf'))
    quiet(steps, tmp_path, dry=True)
    assert ran == [] and not (tmp_path / run.RECORDS).exists()
    quiet(steps, tmp_path)
    ran.clear()
    quiet(steps, tmp_path, force=('ppf',))
    assert ran == ['twin/ppf/A', 'twin/ppf/scores']


def test_the_number_of_workers_and_the_place_do_not_matter(tmp_path, ran):
    quiet(plan.steps_of({'twin': None}, tmp_path / 'a', ('best',), jobs=1), tmp_path / 'a')
    ran.clear()
    (tmp_path / 'a').rename(tmp_path / 'b')
    quiet(plan.steps_of({'twin': None}, tmp_path / 'b', ('best',), jobs=2), tmp_path / 'b')
    assert ran == []
    quiet(plan.steps_of({'twin': None}, tmp_path / 'b', ('best',), seed=1), tmp_path / 'b')
    assert 'twin/best/train' in ran


def test_a_failing_step_names_its_log_and_leaves_no_record(tmp_path):
    step = plan.Step('x/best/A', 'best', 'parse', ('parse', 'set', '--model', 'no-such-model',
                                                   '--out', 'o'), (), tmp_path / 'out.json')
    with pytest.raises(HoocError, match='x_best_A.log'):
        quiet([step], tmp_path)
    assert 'no-such-model' in (tmp_path / 'logs' / 'x_best_A.log').read_text()
    assert run.load_records(tmp_path) == {}


def test_damaged_records_are_named(tmp_path):
    (tmp_path / run.RECORDS).write_text('{"a": 3}')
    with pytest.raises(HoocError, match=run.RECORDS):
        run.load_records(tmp_path)


def test_steps_hang_on_the_code_that_they_run():
    trained = fingerprint.modules_of(plan.CODE['train'])
    # The verifier learns from scenes that the chain has parsed.
    assert {'hooc_perception.training.fit_pixels', 'hooc_perception.synthesis.settle',
            'hooc_perception.core.classification.kernels.pixel_forest',
            'hooc_perception.core.parsing.search'} <= set(trained)
    assert 'hooc_perception.evaluation.scores' not in trained
    parsed = fingerprint.modules_of(plan.CODE['parse'])
    assert 'hooc_perception.core.parsing.search' in parsed
    assert not any(name.startswith('hooc_perception.training') for name in parsed)


def test_comments_do_not_count_as_code_but_numbers_do(tmp_path):
    digests = []
    for k, text in enumerate(['"""Say."""\nX = 1\n', '"""Tell."""\n# Why.\nX = 1\n', 'X = 2\n']):
        path = tmp_path / f'{k}.py'
        path.write_text(text)
        digests.append(fingerprint._parsed(path)[0])
    assert digests[0] == digests[1] != digests[2]


def cells(text, start):
    """Return the stripped cells of the Markdown rows that start with `start`."""
    return [[c.strip(' *`') for c in line.split('|')[1:-1]] for line in text.splitlines()
            if line.replace('*', '').startswith(f'| {start} |')]


def test_the_truth_scores_one_in_every_column_and_a_spoilt_one_does_not(computed):
    records = {'small/best/A': run.Record('k', 'c', 'abc', 7.0, 9.0, 10.0)}
    sections = page.sections_of(computed, ['small', 'absent'], records)
    assert set(sections) == {'small', 'small details', 'small pictures', 'steps'}
    found, certain = sections['small'].split('### Certain but wrong', 1)
    perfect = ['1.000'] * 4 + ['0.000', '0.0', '0', '0'] + ['1.00'] * 4
    (a, b, less), (spoilt,) = cells(found, '`best`'), cells(found, '`ppf`')
    assert a == ['best', 'A', *perfect, '7'] and b == ['best', 'B', *perfect, '-']
    assert less == ['best', 'B, no verifier', *perfect, '-']
    certain_a, _, certain_less = cells(certain, '`best`')
    assert certain_a[2:] == ['2', '0', '0.000', '0.000', *['0.000'] * 4, '0.0']
    assert certain_less[1:] == ['B, no verifier', *certain_a[2:]]
    # The can counts as wrong; its score says that it is certain.
    assert cells(certain, '`ppf`')[0][2:6] == ['2', '1', '0.500', '0.500']
    # Seven centimetres off: near enough for the box of 16 cm, not for the can of 12.
    assert spoilt[2:5] == ['1.000', '0.500', '0.000']
    assert float(spoilt[13]) < 0.3
    assert 'images/results_small_certainty.png' in sections['small pictures']
    assert 'worst' not in sections['small pictures']
    hooc_a, hooc_b = cells(sections['small'], 'the paper, on HOOC')
    assert hooc_a[2:4] == ['0.441', '0.292'] and hooc_b[2:4] == ['0.624', '0.566']
    assert cells(sections['small'], 'can')[0][1:] == ['1', '1', '0']
    assert cells(sections['small details'], 'sellotape core')[0][-1] == '0.71'
    assert cells(sections['steps'], 'all')[0][1] == '7'


def test_pages_take_tables_between_their_markers(computed, tmp_path):
    docs = tmp_path / 'docs'
    (docs / 'images').mkdir(parents=True)
    text = ('before\n<!-- results: small -->\nold\n<!-- end of results -->\nbetween\n'
            '<!-- results: other -->\nkept\n<!-- end of results -->\nafter\n')
    pages = [docs / 'results.md', docs / 'results_more.md']
    pages[0].write_text(text)
    pages[1].write_text('nothing to fill\n')
    written = page.write_pages(pages, docs / 'images', computed, ['small'], {})
    new = pages[0].read_text()
    assert 'old' not in new and 'kept' in new and '### Found and localized' in new
    assert new.startswith('before\n') and new.endswith('after\n') and '\nbetween\n' in new
    assert {path.name for path in written} == {'results.md', 'results_small_errors.png',
                                               'results_small_categories.png',
                                               'results_small_certainty.png'}
    page.write_pages(pages, docs / 'images', computed, ['small'], {})
    assert pages[0].read_text() == new


def test_the_worst_scenes_come_onto_the_page_of_their_set(write_scores, scene_set, tmp_path):
    layout = plan.Layout(tmp_path / 'results', 'small')
    root = write_scores('best', 0.07, 'A')
    assert hooc(['worst', str(scene_set), str(layout.results('best', 'A')), '--out',
                 str(layout.worst)]) == 0
    docs = tmp_path / 'docs'
    (docs / 'images').mkdir(parents=True)
    (docs / 'results.md').write_text('<!-- results: small worst -->\n<!-- end of results -->\n'
                                     '<!-- results: small -->\n<!-- end of results -->\n')
    written = page.write_pages([docs / 'results.md'], docs / 'images', root, ['small'], {})
    text = (docs / 'results.md').read_text()
    assert cells(text, 'one')[0][1:4] == ['0.50', 'can',
                                          'found 7 cm away; few pixels (120)']
    assert [path.name for path in written] == ['results.md', 'results_small_worst.png']


def test_the_worst_scenes_are_those_of_best(tmp_path, ran, scene_set):
    def worst(*rows):
        steps = plan.steps_of({'small': scene_set}, tmp_path, rows)
        return [step for step in steps if step.kind == 'worst']

    assert worst('ppf') == []
    quiet(plan.steps_of({'small': scene_set}, tmp_path, ('best',)), tmp_path)
    step, = worst('ppf')
    layout = plan.Layout(tmp_path, 'small')
    assert {layout.results('best', 'A'), layout.stages('best')} < set(step.inputs)
    assert ran[-1] == 'small/worst'


def test_a_marker_without_an_end_is_named():
    with pytest.raises(HoocError, match='a.md'):
        page.inserted('<!-- results: small -->\n', {}, 'a.md')


def test_the_pages_of_the_documentation_have_the_markers():
    docs = Path(fingerprint.PACKAGE).parent / 'docs'
    names = set()
    for path in docs.glob('results*.md'):
        names |= page.inserted(path.read_text(), {}, str(path))[1]
    assert names >= {f'{name}{what}'
                     for name in ('shapes', 'hots', 'glassware', 'osd', 'dev', 'twin')
                     for what in ('', ' details', ' ablations')} | {
                         'moves', 'steps', 'twin worst', 'dev worst', 'shapes worst',
                         'shapes pictures', 'glassware worst', 'glassware pictures'}


def test_the_command_says_what_is_wrong(tmp_path, capsys):
    assert main(['--out', str(tmp_path), '--rows', 'good', '--dry-run']) == 1
    assert 'good' in capsys.readouterr().err
    assert main(['--out', str(tmp_path), '--dry-run']) == 0
    out = capsys.readouterr().out
    assert 'twin/set: not done yet' in out and 'twin/ppf/scores: depends on another' in out

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Parts of the profile `best` that are switched off: what is run, and what the table shows."""

from hooc_perception.cli.overrides import overrides_of
from hooc_perception.core.profiles import profile, with_overrides
from hooc_perception.experiments import page, plan, run
from hooc_perception.experiments.ablations import SWITCHES, tables_of
import pytest


def cells(text, start):
    """Return the stripped cells of the Markdown rows that start with `start`."""
    return [[c.strip(' *`') for c in line.split('|')[1:-1]] for line in text.splitlines()
            if line.replace('*', '').startswith(f'| {start} |')]


def quiet(*arguments, **options):
    """Run steps without a word."""
    return run.run(*arguments, **options, say=lambda text: None)


@pytest.mark.parametrize('switch', SWITCHES, ids=lambda switch: switch.row)
def test_a_switch_changes_parameters_that_there_are(switch):
    best = profile('best')
    changed = with_overrides(best, overrides_of(switch.parameters))
    for parameter in switch.parameters:
        stage, name = parameter.partition('=')[0].split('.')
        assert changed.stage(stage).values()[name] == 0
        assert best.stage(stage).values()[name] != 0


def test_ablations_stand_on_the_model_of_best(tmp_path, ran):
    def names(*rows):
        return [s.name for s in plan.steps_of({'twin': None}, tmp_path, rows)]

    switches = [f'twin/{s.row}/{what}' for s in SWITCHES for what in ('A', 'scores')]
    best = [f'twin/best/{what}' for what in ('train', 'A', 'B', 'B_no_verifier', 'scores',
                                             'stages')]
    # Where there is no such model yet, and nothing to compare with, that row comes first.
    assert names('ablations') == ['twin/set', *best, *switches, 'twin/plots',
                                  'twin/worst']
    assert names('ablations', 'best') == names('ablations')
    steps = plan.steps_of({'twin': None}, tmp_path, ('ablations',))
    quiet(steps, tmp_path)
    assert names('ablations') == ['twin/set', *switches, 'twin/plots',
                                  'twin/worst']
    ran.clear()
    layout = plan.Layout(tmp_path, 'twin')
    layout.results(SWITCHES[3].row, 'A').unlink()
    quiet(steps, tmp_path)
    assert ran == [f'twin/{SWITCHES[3].row}/A']
    ran.clear()
    quiet(steps, tmp_path, force=('ablations',))
    assert ran == switches
    ran.clear()
    (layout.model('best') / 'file').write_text('another model')
    quiet(plan.steps_of({'twin': None}, tmp_path, ('ablations',)), tmp_path)
    assert ran == switches[::2]


def test_a_switch_is_a_parse_with_other_parameters_and_the_model_of_best(tmp_path, scene_set):
    steps = {s.name: s for s in plan.steps_of({'small': scene_set}, tmp_path, ('ablations',))}
    both = steps['small/ablations/no_refinement_of_hypotheses/A']
    arguments = list(map(str, both.arguments))
    assert arguments[:4] == ['parse', str(scene_set), '--model',
                             str(plan.Layout(tmp_path, 'small').model('best'))]
    assert arguments.count('--set-parameter') == 2
    assert {'propose.refine_steps=0', 'propose.polish_steps=0'} <= set(arguments)
    assert arguments[-1] == str(both.output)
    assert '--true-poses' not in arguments


def test_ablations_are_told_against_best(computed, write_scores):
    assert 'small ablations' not in page.sections_of(computed, ['small'], {})
    write_scores(SWITCHES[0].row, 0.07)
    write_scores(SWITCHES[2].row, 0.0)
    records = {f'small/{row}/A': run.Record('k', code, 'abc', cpu, 9.0, 10.0) for row, code, cpu in
               (('best', 'c', 7.0), (SWITCHES[0].row, 'c', 5.0), (SWITCHES[2].row, 'c', 4.25))}
    text = page.sections_of(computed, ['small'], records)['small ablations']
    assert cells(text, '`best`') == [['best', '-', *['1.000'] * 4, '0.0', *'---', '7.0']]
    assert cells(text, SWITCHES[0].name) == [[
        SWITCHES[0].name, SWITCHES[0].parameters[0], '1.000', '0.500', '0.000', '0.500', '0.0',
        '-0.500', '1', '0', '5.0']]
    # The half that rounds to even is told as it is computed.
    assert cells(text, SWITCHES[2].name)[0][7:] == ['+0.000', '0', '0', '4.2']
    assert len(text.splitlines()) == 9 and 'other code' not in text and 'same code' not in text
    records[f'small/{SWITCHES[2].row}/A'] = run.Record('k', 'd', 'abd', 4.0, 9.0, 10.0)
    sections = page.sections_of(computed, ['small'], records)
    assert 'same code' in sections['small ablations']
    assert cells(sections['steps'], 'small/ablations (2)')[0][1:] == ['9', '18', '10', 'abc abd']


def test_ablations_without_best_show_no_change(computed, write_scores):
    write_scores(SWITCHES[0].row, 0.07)
    plan.Layout(computed, 'small').scores('best').unlink()
    text = page.sections_of(computed, ['small'], {})['small ablations']
    assert cells(text, '`best`') == []
    assert cells(text, SWITCHES[0].name)[0][3:] == ['0.500', '0.000', '0.500', '0.0', *'----']


def test_ablations_of_labelled_scenes_are_told_by_masks():
    def content(*ious):
        masks = [{'explained': sum(i >= 0.5 for i in scene), 'labelled': len(scene),
                  'estimated': 2, 'iou': scene} for scene in ious]
        return {'results': [{'setting': 'A', 'masks': masks}]}

    table, = tables_of('small', content([0.9, 0.8], [0.7, 0.2]),
                       {SWITCHES[0].row: content([0.9, 0.4], [0.3, 0.5])}, {})
    best, less = table.rows
    assert best[2:4] == ('0.750', '0.750')
    assert less[2:] == ('0.500', '0.500', '-0.250', 2, 1, None)

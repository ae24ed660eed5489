# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""`hooc evaluate` and `hooc report` from end to end on a small set."""

import json

from hooc_perception.cli.main import main
from hooc_perception.evaluation import paper
from hooc_perception.evaluation.tables import Table, to_markdown, to_text
from PIL import Image
import pytest


@pytest.fixture
def truth_file(truth_results, tmp_path):
    path = tmp_path / 'truth.json'
    path.write_text(json.dumps(truth_results))
    return path


def test_evaluate_prints_the_papers_tables(tiny_path, truth_file, capsys):
    assert main(['evaluate', str(tiny_path), str(truth_file)]) == 0
    out = capsys.readouterr().out
    for word in ('Table 1', 'Table 2', 'Table 4', 'paper, HOOC mean', 'Per category',
                 'Explained masks', 'recall 1.000', '1.3000', 'Certain but wrong, sizes'):
        assert word in out, word
    assert 'Table 3: parsing' not in out
    mean = next(line for line in out.splitlines() if line.startswith('mean  '))
    assert mean.split()[1:4] == ['1.000'] * 3


def test_several_results_stand_side_by_side_and_b_is_table_3(tiny_path, truth_results, tmp_path,
                                                             capsys):
    files = []
    for name, setting in (('one', 'A'), ('two', 'A'), ('three', 'B')):
        files.append(tmp_path / f'{name}.json')
        files[-1].write_text(json.dumps(truth_results | {'setting': setting}))
    assert main(['evaluate', str(tiny_path), *map(str, files)]) == 0
    out = capsys.readouterr().out
    assert '[1] one, [2] two' in out and 'Table 3: parsing' in out


def test_evaluate_writes_json_markdown_plots_and_csv(tiny_path, truth_file, tmp_path):
    out = tmp_path / 'out'
    assert main(['evaluate', str(tiny_path), str(truth_file), '--bop', '--json',
                 str(out / 'a.json'), '--markdown', str(out / 'a.md'), '--plots',
                 str(out / 'plots')]) == 0
    assert main(['export', str(tiny_path), str(truth_file), '--out', str(out / 'a.csv')]) == 0
    scores = json.loads((out / 'a.json').read_text())
    assert scores['results'][0]['mean']['localized'] == 1
    assert scores['results'][0]['bop']['average'] == 1
    assert scores['results'][0]['certainty']['certain']['wrong'] == 0
    assert scores['results'][0]['shape']['surface_m'] == 0
    assert set(scores['visibility']) == {'10_1', '10_2'}
    assert 0 < scores['visibility']['10_1'][0]['total'] < 1
    assert '| **mean** |' in (out / 'a.md').read_text()
    assert len((out / 'a.csv').read_text().splitlines()) == 17
    for name in ('categories.png', 'errors.png', 'certainty.png'):
        assert min(Image.open(out / 'plots' / name).size) > 300


def test_without_results_only_the_visibility_is_told(tiny_path, capsys):
    assert main(['evaluate', str(tiny_path), '--scene', '10_1']) == 0
    out = capsys.readouterr().out
    assert 'Table 1: visibility in scene 10_1' in out and 'Table 2' not in out


@pytest.mark.parametrize('arguments, word', [
    (['--scene', 'elsewhere'], 'elsewhere'), (['--model', 'no/such/folder'], 'no/such/folder'),
    (['--stages'], 'hooc stages'), (['--worst', '3', '--plots', 'p'], 'hooc worst'),
    (['--stages-from', 'a.json'], 'hooc worst'), (['--baseline', 'ppf'], 'hooc baseline'),
    (['--bop-csv', 'a.csv'], 'hooc export'), (['--visibility'], 'without results'),
    (['--seed=3'], 'seed 0'), (['--executor', 'local'], 'hooc stages')])
def test_evaluate_says_what_is_wrong(tiny_path, truth_file, capsys, arguments, word):
    assert main(['evaluate', str(tiny_path), str(truth_file), *arguments]) == 1
    error = capsys.readouterr().err
    assert word in error and len(error.strip().splitlines()) == 1


def test_set_without_truth_is_refused(tiny_path, truth_file, capsys):
    assert main(['evaluate', str(tiny_path), str(truth_file), '--scene', 'nobody']) == 1
    assert 'nothing to score' in capsys.readouterr().err


def test_report_writes_a_page(tiny_path, truth_file, tmp_path, capsys):
    assert main(['report', str(truth_file), '--set', str(tiny_path), '--out',
                 str(tmp_path / 'r.html')]) == 0
    html = (tmp_path / 'r.html').read_text()
    assert all(f'>{name}<' in html for name in ('10_1', '10_2', 'labelled'))
    assert '3 scenes' in capsys.readouterr().out


def test_results_of_another_set_are_refused(tiny_path, truth_results, tmp_path, capsys):
    for scene in truth_results['scenes']:
        scene['scene'] += '_elsewhere'
    (tmp_path / 'r.json').write_text(json.dumps(truth_results))
    assert main(['evaluate', str(tiny_path), str(tmp_path / 'r.json')]) == 1
    assert 'no scene in common' in capsys.readouterr().err


def test_what_is_not_of_the_set_is_said(tiny_path, truth_results, tmp_path, capsys):
    truth_results['scenes'][0]['scene'] = 'elsewhere'
    file = tmp_path / 'r.json'
    file.write_text(json.dumps(truth_results | {'dataset': 'other'}))
    assert main(['evaluate', str(tiny_path), str(file)]) == 0
    scenes, dataset = capsys.readouterr().err.splitlines()
    assert 'scene elsewhere is not in' in scenes and "dataset 'other'" in dataset
    assert main(['report', str(file), '--set', str(tiny_path), '--out',
                 str(tmp_path / 'r.html')]) == 0
    assert 'scene elsewhere is not in' in capsys.readouterr().err
    # One scene of the set is no results of another set.
    assert main(['evaluate', str(tiny_path), str(file), '--scene', '10_2']) == 0


def test_report_needs_to_know_the_set(truth_file, tiny_path, truth_results, tmp_path, capsys):
    assert main(['report', str(truth_file), '--out', str(tmp_path / 'r.html')]) == 1
    assert 'name the set with --set' in capsys.readouterr().err
    for place in (3, 'gone', 'a\0b'):
        truth_file.write_text(json.dumps(truth_results | {'set': place}))
        assert main(['report', str(truth_file), '--out', str(tmp_path / 'r.html')]) == 1
        assert 'name the set with --set' in capsys.readouterr().err
    (tmp_path / 'link').symlink_to(tiny_path)
    truth_file.write_text(json.dumps(truth_results | {'set': 'link'}))
    assert main(['report', str(truth_file), '--out', str(tmp_path / 'r.html')]) == 0


def test_report_of_a_foreign_set_is_refused(tiny_path, truth_results, tmp_path, capsys):
    for scene in truth_results['scenes']:
        scene['scene'] += '_elsewhere'
    (tmp_path / 'r.json').write_text(json.dumps(truth_results))
    assert main(['report', str(tmp_path / 'r.json'), '--set', str(tiny_path)]) == 1
    assert 'no scene in common' in capsys.readouterr().err


def test_tables_align_and_escape():
    table = Table('T', ('name', 'x'), (('a|b', 0.5), ('mean', None)), ('note',), (1,))
    lines = to_text(table).splitlines()
    assert lines[0] == 'T' and lines[3].endswith('0.50') and lines[-1] == 'note'
    assert 'a\\|b' in to_markdown(table) and '**mean**' in to_markdown(table)


def test_the_papers_means_are_those_it_prints():
    assert round(paper.mean('A', 'found'), 2) == 0.44
    assert round(paper.mean('A', 'localized'), 2) == 0.29
    assert round(paper.mean('B', 'found'), 2) == 0.62
    assert round(paper.mean('B', 'localized'), 2) == 0.57
    for triples in paper.ENERGY.values():
        for total, *terms in triples:
            assert total == pytest.approx(sum(terms), abs=2e-4)

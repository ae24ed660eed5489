# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The demo's table and its bundle."""

from pathlib import Path
from types import SimpleNamespace

from hooc_perception.cli import demo
from hooc_perception.cli.main import main
from hooc_perception.errors import HoocError
from hooc_perception.evaluation.tables import to_text
import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
MODEL = SimpleNamespace(longest_side=0.2, symmetry=np.ones(3, int))
MODELS = dict.fromkeys(('cup', 'ball', 'tray'), MODEL)


def thing(category, x, score=None):
    """Return an object of a results file, or a true one where it has no score."""
    return {'category': category, 'translation': [x, 0, 0], 'rotation_xyzw': [0, 0, 0, 1],
            'size': [0.2, 0.1, 0.1], 'score': score}


def test_table_tells_found_from_localized_and_from_invented():
    entry = {'seconds': 1.5, 'objects': [thing('cup', 0.013, 0.9), thing('ball', 0.5, 0.4),
                                         thing('ball', 0.7, 0.3)]}
    truth = [SimpleNamespace(**thing(name, 0)) for name in ('cup', 'ball', 'tray')]
    table = demo.comparison(entry, truth, MODELS)
    assert [row[:4] for row in table.rows] == [
        ('cup', 'yes', 'yes', '13'), ('ball', 'yes', 'no', '500'), ('tray', 'no', 'no', None),
        ('ball', 'false positive', None, None)]
    text = to_text(table)
    assert '2 of 3 found, 1 localized, 1 false positives; 1.5 s' in text


def test_without_a_bundle_the_mend_is_named(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(demo, '__file__', str(tmp_path / 'a/b/c/d/e/f.py'))
    monkeypatch.setattr(demo.sys, 'prefix', str(tmp_path))
    with pytest.raises(HoocError, match='make bundle'):
        demo.bundle_root()
    assert main(['demo', '--out', str(tmp_path / 'out')]) == 1
    assert 'make bundle' in capsys.readouterr().err


@pytest.mark.parametrize('package, share', [
    ('hooc_perception', '.'), ('lib/python3.11/site-packages/hooc_perception',
                               'share/hooc_perception')])
def test_the_bundle_is_found_in_a_source_tree_and_where_colcon_installs(
        monkeypatch, tmp_path, package, share):
    monkeypatch.setattr(demo, '__file__', str(tmp_path / package / 'cli/demo.py'))
    monkeypatch.setattr(demo.sys, 'prefix', str(tmp_path / 'elsewhere'))
    (tmp_path / share / demo.SCENE).mkdir(parents=True)
    (tmp_path / share / demo.SCENE / 'metadata.yaml').touch()
    (tmp_path / share / demo.MODEL).mkdir(parents=True)
    assert demo.bundle_root().resolve() == (tmp_path / share).resolve()


def test_a_shallow_source_tree_is_no_trouble(monkeypatch):
    monkeypatch.setattr(demo, '__file__', '/nowhere/hooc_perception/cli/demo.py')
    with pytest.raises(HoocError, match='make bundle'):
        demo.bundle_root()


@pytest.fixture(scope='module')
def bundle():
    """Return the source tree where it holds the bundle."""
    if not (ROOT / demo.SCENE / 'metadata.yaml').is_file():
        pytest.skip('the bundle has not been made yet')
    return ROOT


def test_the_bundle_stays_small(bundle):
    size = sum(path.stat().st_size for part in (demo.SCENE, demo.MODEL)
               for path in (bundle / part).rglob('*') if path.is_file())
    assert size < 25e6


@pytest.mark.slow
def test_demo(bundle, tmp_path, capsys):
    pytest.importorskip('rclpy')
    assert main(['demo', '--out', str(tmp_path)]) == 0
    text = capsys.readouterr().out
    assert 'Objects found beside the ground truth' in text
    assert ' of 10 found' in text
    page = (tmp_path / 'report.html').read_text()
    assert '<img' in page or '<svg' in page

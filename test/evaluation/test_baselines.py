# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The baselines find an easy object, and their results are results."""

import cv2
from hooc_perception.cli.main import main
from hooc_perception.evaluation.baselines import BaselineConfig, run_baseline
from hooc_perception.evaluation.evaluate import evaluate_results
from hooc_perception.io.scenes.results import load_results
import pytest


@pytest.mark.parametrize('name', ['fpfh', 'ppf'])
def test_baseline_finds_something_where_objects_stand_apart(tiny, models, tmp_path, name):
    one = tiny.selected(['10_1'])
    run_baseline(name, one, models, tmp_path / 'b.json', 1,
                 BaselineConfig(iterations=20000, min_fit=0.2, pair_step=0.1))
    results = load_results(tmp_path / 'b.json')
    score = evaluate_results(one, results, models).scores[0]
    assert score.localized >= 1 / 3
    assert all(0 < o['score'] <= 1 for o in results['scenes'][0]['objects'])


def test_missing_module_is_named(tiny_path, tmp_path, capsys, monkeypatch):
    monkeypatch.delattr(cv2, 'ppf_match_3d_PPF3DDetector')
    assert main(['baseline', str(tiny_path), '--method', 'ppf', '--out',
                 str(tmp_path / 'b.json')]) == 1
    assert 'opencv-contrib-python-headless' in capsys.readouterr().err

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Damaged bags, messages, models: read or rejected in one sentence; failures are noticed."""

from hooc_perception.benchmark import fuzz as fuzzer
from hooc_perception.benchmark.mutate import damaged
from hooc_perception.cli.main import main
import numpy as np
import pytest

# Cases that failed once: (kind, number, seed).
FIXED = [(kind, number, seed) for kind, cases in {
    'messages of a stage': [(554, 1), (5, 0), (21, 0), (45, 0), (61, 0), (493, 0)],
    'sqlite bag': [(679, 0)], 'messages of a camera': [(832, 1)],
    'classifiers': [(46, 0), (58, 0), (178, 0), (342, 0)]}.items() for number, seed in cases]

FOES = """
import ctypes, time
from hooc_perception.errors import HoocError
def refuse(rng, folder): raise HoocError('it is broken; mend it')
def babble(rng, folder): raise HoocError('it is broken;\\nmend it')
def fall(rng, folder): raise KeyError('oh')
def crash(rng, folder): ctypes.string_at(0)
def hang(rng, folder): time.sleep(60)
def gorge(rng, folder): bytearray(2 ** 36)
def foes():
    return dict(a=refuse, b=babble, c=fall, d=crash, e=hang, f=gorge, g=lambda *_: None)
"""


def test_a_sample_of_all_kinds():
    result = fuzzer.fuzz(66, seed=3)
    assert result.failures == []
    assert sum(result.outcomes.values()) == 66
    outcomes = {outcome for _, outcome in result.outcomes}
    assert outcomes == {fuzzer.READ, fuzzer.REJECTED}


@pytest.mark.parametrize('kind, number, seed', FIXED)
def test_what_failed_once_does_not_any_more(tmp_path, kind, number, seed):
    kinds = {kind: fuzzer.kinds_of_cases()[kind]}
    kind, outcome, text = fuzzer.run_case(number, seed, kinds, tmp_path)
    assert outcome in (fuzzer.READ, fuzzer.REJECTED), (kind, text)


def test_the_fuzzer_sees_every_way_to_fail(tmp_path, monkeypatch):
    (tmp_path / 'foes.py').write_text(FOES)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(fuzzer, 'HANG_S', 3.0)
    result = fuzzer.fuzz(7, source='foes:foes')
    assert result.outcomes == {('a', 'rejected'): 1, ('g', 'read'): 1}
    texts = {number: text for number, _, text in result.failures}
    assert 'not one sentence' in texts[1] and 'KeyError' in texts[2]
    assert 'died' in texts[3] and 'not finished' in texts[4] and 'requested' in texts[5]


def test_damage_is_damage_and_the_same_for_a_seed():
    data = bytes(range(256)) * 20
    rows = [damaged(data, np.random.default_rng(seed)) for seed in range(200)]
    assert sum(row != data for row in rows) > 195
    assert rows == [damaged(data, np.random.default_rng(seed)) for seed in range(200)]
    assert damaged(b'', np.random.default_rng(0)) is not None


def test_from_the_command_line(capsys, monkeypatch, tmp_path):
    (tmp_path / 'foes.py').write_text(FOES)
    monkeypatch.syspath_prepend(str(tmp_path))
    run = fuzzer.fuzz
    monkeypatch.setattr(fuzzer, 'fuzz', lambda *args: run(*args, source='foes:foes'))
    assert main(['bench', 'fuzz', '--cases', '1', '--seed', '5']) == 0
    assert '1 cases of seed 5; 0 failed' in capsys.readouterr().out
    assert main(['bench', 'fuzz', '--cases', '2']) == 1
    assert 'case 1 (b): not one sentence' in capsys.readouterr().out
    assert main(['bench', 'fuzz', '--cases', '0']) == 1

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""`hooc train` wants meshes and cameras, and nothing else."""

from types import SimpleNamespace

from hooc_perception.cli import main as cli
from hooc_perception.objects.catalogue import CATALOGUE, write_catalogue
from hooc_perception.training.train import PROFILES


def test_a_set_without_any_scene_can_be_trained_on(tmp_path, monkeypatch, capsys):
    given = {}

    def train(scene_set, out, profile, seed, jobs, configs):
        given.update(scene_set=scene_set, out=out, configs=configs)
        return SimpleNamespace(path=out, models=scene_set.categories, profile=profile)

    monkeypatch.setattr('hooc_perception.training.train.train', train)
    write_catalogue(tmp_path / 'set')
    assert not (tmp_path / 'set' / 'scenes').exists()
    assert cli.main(['train', str(tmp_path / 'set'), '--out', str(tmp_path / 'm')]) == 0
    assert given['scene_set'].scenes == () and len(given['scene_set'].cameras) == 3
    assert f'{len(CATALOGUE)} categories' in capsys.readouterr().out
    assert given['configs'] == PROFILES['best']
    words = ['train', str(tmp_path / 'set'), '--out', str(tmp_path / 'm'), '--relatives']
    assert cli.main(words) == 0
    assert given['configs'][0].relatives and given['configs'][1].trees == 60
    assert given['configs'][0].strangers == 0
    words[-1] = '--strangers'
    assert cli.main(words) == 0
    assert given['configs'][0].strangers == 5 and given['configs'][1] == PROFILES['best'][1]
    assert cli.main([*words, '--profile', 'paper']) == 1
    assert 'leave out --strangers' in capsys.readouterr().err
    words[-1] = '--relatives'
    assert cli.main([*words, '--profile', 'paper']) == 1
    assert 'leave out --relatives' in capsys.readouterr().err


def sentence(capsys):
    """Return what the command printed as its one line of error."""
    line, = capsys.readouterr().err.splitlines()
    return line


def test_what_cannot_be_written_is_refused_before_training(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr('hooc_perception.training.train.generic_models', None)
    write_catalogue(tmp_path / 'set')
    (tmp_path / 'full' / 'notes').mkdir(parents=True)
    assert cli.main(['train', str(tmp_path / 'set'), '--out', str(tmp_path / 'full')]) == 1
    assert 'exists and is not a model folder' in sentence(capsys)
    file = tmp_path / 'set' / 'dataset.yaml'
    first, second = list(CATALOGUE)[:2]
    file.write_text(file.read_text().replace(f'name: {second},', f'name: {first.upper()},')
                    .replace(f'name: {second}\n', f'name: {first.upper()}\n'))
    assert cli.main(['train', str(tmp_path / 'set'), '--out', str(tmp_path / 'm')]) == 1
    assert f'{first!r} and {first.upper()!r} would share a file' in sentence(capsys)

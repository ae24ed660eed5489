# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""`hooc train` wants meshes and cameras, and nothing else."""

from types import SimpleNamespace

from hooc_perception.cli import main as cli
from hooc_perception.models.catalogue import CATALOGUE, write_catalogue


def test_a_set_without_any_scene_can_be_trained_on(tmp_path, monkeypatch, capsys):
    given = {}

    def train(scene_set, out, profile, seed, jobs):
        given.update(scene_set=scene_set, out=out)
        return SimpleNamespace(path=out, models=scene_set.categories, profile=profile)

    monkeypatch.setattr('hooc_perception.training.train.train', train)
    write_catalogue(tmp_path / 'set')
    assert not (tmp_path / 'set' / 'scenes').exists()
    assert cli.main(['train', str(tmp_path / 'set'), '--out', str(tmp_path / 'm')]) == 0
    assert given['scene_set'].scenes == () and len(given['scene_set'].cameras) == 3
    assert f'{len(CATALOGUE)} categories' in capsys.readouterr().out

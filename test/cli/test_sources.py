# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""`hooc parse` reads the bundled bag as it reads a scene set."""

from dataclasses import replace

from hooc_perception.cli.report_source import source_of
from hooc_perception.cli.sources import load_source, provenance
from hooc_perception.errors import HoocError
from hooc_perception.io.bags.folder import is_bag
from hooc_perception.io.bags.reader import BagScene
from hooc_perception.io.bags.sequences import BagFrameSet
from hooc_perception.io.bags.writer import write_sequence
from hooc_perception.io.scenes.scene_set import SceneSet
from hooc_perception.io.scenes.sequences import RecordedSequence
from hooc_perception.trained.folder import load_model_folder
import numpy as np
import pytest


@pytest.fixture(scope='module')
def model(repository):
    """Return the bundled model."""
    return load_model_folder(repository / 'models/demo')


def test_bags_are_told_from_other_folders(repository, tmp_path):
    bag = repository / 'bags/demo'
    assert is_bag(bag) and is_bag(next(bag.glob('*.mcap')))
    assert not is_bag(tmp_path) and not is_bag(tmp_path / 'none.mcap')


def test_a_bag_is_a_set_of_one_scene(repository, model):
    bag = repository / 'bags/demo'
    source = load_source(bag, model)
    scene, = source.scenes
    assert source.selected([scene.name]).scenes == source.selected(None).scenes == (scene,)
    assert source.sequences == ()
    with pytest.raises(HoocError, match='no scene'):
        source.selected(['another'])
    assert set(source.category_names) == {generic.name for generic in model.models}
    for got, wanted in zip(scene.depth(), BagScene(bag).depth(), strict=True):
        assert np.array_equal(got.depth, wanted.depth, equal_nan=True)


def test_a_bag_of_a_sequence_is_a_set_of_its_frame_sets(repository, model, tmp_path):
    class Still(BagScene):
        """The bundled scene as a frame set of another name."""

        depth_units = (0.001,) * 3

    frames = []
    for name in ('b', 'a'):
        frames.append(Still(repository / 'bags/demo'))
        frames[-1].name = name
    sequence = RecordedSequence('s', 0.5, ('b', 'a'), {1: 'arm in'})
    scene_set = SceneSet(tmp_path, 'still', 'table', (), frames[0].cameras, 1, tuple(frames))
    bag = write_sequence(sequence, scene_set, tmp_path)
    source = load_source(bag, model)
    assert [scene.name for scene in source.scenes] == ['b', 'a']
    assert source.sequences == (sequence,) and source.name == 'still'
    assert source.selected(['s']).scenes == source.scenes
    part = source.selected(['a'])
    assert part.scenes == source.scenes[1:] and part.sequences == ()
    with pytest.raises(HoocError, match='no scene .c.; the bag holds b, a'):
        source.selected(['c'])
    # `hooc report` finds the frame set of each entry, and that of `hooc run` under the bag's name.
    results = {'dataset': 'still', 'scenes': [{'scene': n, 'bag': 's'} for n in ('a', 's')]}
    shown = source_of(str(tmp_path / 'r.json'), None, [], results, model)
    assert [type(scene) for scene in shown.scenes] == [BagScene, BagFrameSet]
    assert [scene.name for scene in shown.scenes] == ['s', 'a']


def test_the_model_says_what_a_bag_does_not(repository, model, monkeypatch):
    info = BagScene(repository / 'bags/demo').info
    plain = BagScene.__init__

    def silent(self, path):
        plain(self, path)
        self.info.update(categories=[], max_instances=-1)
    monkeypatch.setattr(BagScene, '__init__', silent)
    source = load_source(repository / 'bags/demo', replace(model, max_instances=7))
    assert source.max_instances == 7
    assert source.category_names == tuple(generic.name for generic in model.models)
    monkeypatch.undo()
    assert load_source(repository / 'bags/demo', model).max_instances == info['max_instances']


def test_results_name_the_bag_and_the_model_relative_to_themselves(repository, model):
    source = load_source(repository / 'bags/demo', model)
    of_file, of_scene = provenance(source, repository / 'models/demo', repository / 'out/r.json')
    assert of_file == {'model': '../models/demo'} and of_scene == {'bag': '../bags/demo'}

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The MODEL folder: what is saved comes back, and what was tampered with does not."""

from dataclasses import replace
import hashlib
import json
from pathlib import Path
import shutil

from hooc_perception.core.types import Camera
from hooc_perception.errors import HoocError
from hooc_perception.objects.derive import derive
from hooc_perception.trained.folder import (
    check_place,
    load_model_folder,
    save_model_folder,
)
import numpy as np
import pytest
import trimesh

CAMERA = Camera('kinect1', 512, 424, np.array([[365.0, 0, 257], [0, 365, 208], [0, 0, 1]]),
                np.array([0.09, -0.27, 0, 0, 0.09]), np.eye(4))
CLASSIFIER = {'features': np.arange(12, dtype=np.float32).reshape(3, 4),
              'leaves': np.arange(20, dtype=np.uint8), 'empty': np.zeros((0, 3), np.int32),
              'scale': np.float64(0.5)}


@pytest.fixture(scope='module')
def models():
    shapes = {'box': trimesh.creation.box((0.1, 0.2, 0.3)),
              'ball': trimesh.creation.icosphere(2, 0.05),
              'can': trimesh.creation.cylinder(0.03, 0.12)}
    return tuple(derive(name, mesh, np.random.default_rng(0)) for name, mesh in shapes.items())


@pytest.fixture(scope='module')
def saved(models, tmp_path_factory):
    path = tmp_path_factory.mktemp('models') / 'kitchen'
    save_model_folder(path, 'kitchen', models, CLASSIFIER, 'fast', 7, (CAMERA,), 1)
    return path


@pytest.fixture
def folder(saved, tmp_path):
    """Return a copy that a test may spoil."""
    return shutil.copytree(saved, tmp_path / 'kitchen')


def _edit(folder, change):
    """Apply a function to the dict in model.json."""
    meta = json.loads((folder / 'model.json').read_text())
    change(meta)
    (folder / 'model.json').write_text(json.dumps(meta))


def _rejected(folder, words):
    with pytest.raises(HoocError, match=words) as caught:
        load_model_folder(folder)
    assert '\n' not in str(caught.value)


def _same(a, b):
    """Assert that two GenericModels are equal, and so are their variants."""
    assert len(a.variants) == len(b.variants)
    for key in vars(a).keys() - {'variants'}:
        np.testing.assert_array_equal(getattr(a, key), getattr(b, key))
        assert np.asarray(getattr(a, key)).dtype == np.asarray(getattr(b, key)).dtype
    for one, other in zip(a.variants, b.variants):
        _same(one, other)


@pytest.fixture(scope='module')
def families(models):
    """Return two categories, the second with three meshes."""
    box, ball, can = models
    return (ball, replace(box, variants=(replace(can, name='box'),
                                         replace(ball, name='box'))))


@pytest.fixture
def family_folder(families, tmp_path):
    """Return a MODEL folder of them."""
    path = tmp_path / 'families'
    save_model_folder(path, 'kitchen', families, CLASSIFIER, 'fast', 7, (CAMERA,), 1)
    return path


def test_families_there_and_back(family_folder, families):
    back = load_model_folder(family_folder)
    assert [m.name for m in back.models] == ['ball', 'box']
    for a, b in zip(families, back.models):
        _same(a, b)
    assert sorted(p.name for p in (family_folder / 'meshes').iterdir()) == [
        'ball.ply', 'box.1.ply', 'box.2.ply', 'box.ply']
    for model in families:
        for k, member in enumerate(model.members):
            path, digest = back.mesh_of(model.name, k)
            assert path == back.mesh_path(model.name, k)
            assert digest == hashlib.sha256(path.read_bytes()).hexdigest()
            np.testing.assert_allclose(trimesh.load(path, process=False).extents, member.extents,
                                       rtol=1e-5)
    assert back.mesh_of('box') == back.mesh_of('box', 0) == (
        family_folder / 'meshes' / 'box.ply', back.mesh_sha256['box'])


def test_meshes_of_members_are_checked_too(family_folder):
    file = family_folder / 'meshes' / 'box.2.ply'
    data = file.read_bytes()
    file.write_bytes(data[:-1] + b'x')
    _rejected(family_folder, 'box.2.ply is damaged')
    file.unlink()
    _rejected(family_folder, 'box.2.ply is missing')
    file.write_bytes(data)
    _edit(family_folder, lambda meta: meta['files'].pop('meshes/box.2.ply'))
    _rejected(family_folder, 'does not list meshes/box.2.ply')


def test_folders_from_before_there_were_families(folder, models):
    def write(path):
        arrays = dict(np.load(path))
        assert arrays.pop('members').tolist() == [1, 1, 1]
        np.savez(path, **arrays)
    _replace(folder, 'models.npz', write)
    back = load_model_folder(folder)
    for a, b in zip(models, back.models):
        _same(a, b)
    assert len(back.mesh_of('can')[1]) == 64


@pytest.mark.parametrize('members', [
    [3, 1], [1, 1], [0, 4], [-1, 5], [4], [1, 1, 2], [[1, 3]], [1.0, 3.0],
    [1, 2 ** 62], [2 ** 62, 2 ** 62], [1, -2 ** 63 + 3]])
def test_families_that_do_not_add_up(family_folder, members):
    def write(path):
        np.savez(path, **{**np.load(path), 'members': np.array(members)})
    _replace(family_folder, 'models.npz', write)
    if members == [3, 1]:
        # Which category a mesh belongs to is for the trainer to know, but its file must be there.
        _rejected(family_folder, 'does not list meshes/ball.1.ply')
    else:
        _rejected(family_folder, 'models.npz is not what hooc train writes')


@pytest.mark.parametrize('names', [('can', 'can.1'), ('can.12', 'can'), ('Can', 'can.2')])
def test_categories_do_not_take_the_files_of_members(tmp_path, models, names):
    taken = [replace(model, name=name) for model, name in zip(models, names)]
    with pytest.raises(HoocError, match='share a file') as error:
        save_model_folder(tmp_path / 'm', 'x', taken, CLASSIFIER, 'fast', 0, ())
    assert all(repr(name) in str(error.value) for name in names)
    check_place(tmp_path / 'm', ['can.1', 'can.x', 'tin', 'tin.1a', '1.2'])


def test_there_and_back(saved, models):
    back = load_model_folder(saved)
    assert (back.name, back.profile, back.seed, back.max_instances) == ('kitchen', 'fast', 7, 1)
    assert [m.name for m in back.models] == ['box', 'ball', 'can']
    for a, b in zip(models, back.models):
        _same(a, b)
    assert list(back.classifier) == list(CLASSIFIER)
    for key, array in CLASSIFIER.items():
        assert type(back.classifier[key]) is np.ndarray
        assert back.classifier[key].dtype == array.dtype
        np.testing.assert_array_equal(back.classifier[key], array)
    camera = back.cameras[0]
    assert (camera.name, camera.width, camera.height) == ('kinect1', 512, 424)
    for key in ('K', 'D', 'T_world_camera'):
        np.testing.assert_array_equal(getattr(camera, key), getattr(CAMERA, key))


def test_meshes_are_there_for_viewers(saved, models):
    back = load_model_folder(saved)
    for model in models:
        mesh = trimesh.load(back.mesh_path(model.name), process=False)
        np.testing.assert_allclose(mesh.extents, model.extents, rtol=1e-5)
        assert len(back.mesh_sha256[model.name]) == 64


def test_writing_to_a_loaded_array_leaves_the_file_alone(folder):
    load_model_folder(folder).classifier['leaves'][:] = 99
    np.testing.assert_array_equal(load_model_folder(folder).classifier['leaves'], np.arange(20))


def test_replaced_as_a_whole_or_not_at_all(folder, models):
    with pytest.raises(HoocError, match='leaves'):
        save_model_folder(folder, 'x', models[:1], {'leaves': np.array([object()])}, 'fast', 0, ())
    assert load_model_folder(folder).name == 'kitchen'
    save_model_folder(folder, 'second', models[:1], {}, 'best', 0, ())
    back = load_model_folder(folder)
    assert back.name == 'second' and len(back.models) == 1 and not back.classifier
    assert [p.name for p in folder.parent.iterdir()] == ['kitchen']


def test_other_folders_are_not_overwritten(tmp_path, models):
    (tmp_path / 'notes.txt').write_text('mine')
    with pytest.raises(HoocError, match='not a model folder'):
        save_model_folder(tmp_path, 'x', models, {}, 'fast', 0, ())
    assert (tmp_path / 'notes.txt').read_text() == 'mine'


@pytest.mark.parametrize('name', ['../evil', 'a/b', '', '.hidden', 'a b', 'x' * 200])
def test_names_must_be_fit_for_files(tmp_path, models, name):
    with pytest.raises(HoocError, match='name'):
        save_model_folder(tmp_path / 'm', 'x', models, {name: np.zeros(3)}, 'fast', 0, ())
    assert not (tmp_path / 'm').exists()


def test_names_must_differ_as_topics(folder, models, tmp_path):
    taken = [replace(models[0], name='can-1'), replace(models[2], name='can.1')]
    with pytest.raises(HoocError, match="'can-1' and 'can.1' would share"):
        save_model_folder(tmp_path / 'm', 'x', taken, CLASSIFIER, 'fast', 0, ())
    assert not (tmp_path / 'm').exists()
    _edit(folder, lambda meta: meta.update(categories=['can-1', 'ball', 'can_1']))
    _rejected(folder, "'can-1' and 'can_1' would share")


def test_not_a_model_folder(tmp_path):
    _rejected(tmp_path, 'not a model folder')
    _rejected(tmp_path / 'nowhere', 'not a model folder')


@pytest.mark.parametrize('text, words', [
    ('{', 'not valid JSON'), ('[1]', 'format None'), ('{"format": "hooc-model/2"}', 'model/2'),
    ('{"format": "hooc-model/1"}', 'lacks'), ('[' * 100000, 'not valid JSON'),
    ('{"format": "hooc-model/1", "files": 3}', 'lacks')])
def test_garbled_meta_data(folder, text, words):
    (folder / 'model.json').write_text(text)
    _rejected(folder, words)


@pytest.mark.parametrize('file', ['models.npz', 'meshes/ball.ply', 'classifier/leaves.npy'])
def test_missing_and_damaged_files(folder, file):
    data = bytearray((folder / file).read_bytes())
    (folder / file).write_bytes(data[:-1])
    _rejected(folder, 'damaged')
    data[len(data) // 2] ^= 1
    (folder / file).write_bytes(data)
    _rejected(folder, 'checksum')
    (folder / file).unlink()
    _rejected(folder, f'{file} is missing')


def test_paths_out_of_the_folder(folder, tmp_path):
    for field in ('categories', 'classifier'):
        spoiled = shutil.copytree(folder, tmp_path / field)
        _edit(spoiled, lambda meta, field=field: meta[field].append('../../secret'))
        _rejected(spoiled, 'secret')
    outside = tmp_path / 'leaves.npy'
    shutil.move(folder / 'classifier' / 'leaves.npy', outside)
    (folder / 'classifier' / 'leaves.npy').symlink_to(outside)
    _rejected(folder, 'points outside')


def _mirror(folder, link):
    """Make the folder `link` with a link to each file of `folder`, as colcon does."""
    for file in filter(Path.is_file, sorted(folder.rglob('*'))):
        target = link / file.relative_to(folder)
        target.parent.mkdir(parents=True, exist_ok=True)
        target.symlink_to(file)
    return link


def test_a_folder_of_links_to_a_model_folder(folder, tmp_path):
    build = _mirror(folder, tmp_path / 'build')
    install = _mirror(build, tmp_path / 'install')
    found, wanted = load_model_folder(install), load_model_folder(folder)
    assert found.mesh_sha256 == wanted.mesh_sha256
    assert all(np.array_equal(found.classifier[key], wanted.classifier[key])
               for key in wanted.classifier)
    leaves = install / 'classifier' / 'leaves.npy'
    outside = shutil.copyfile(folder / 'classifier' / 'leaves.npy', tmp_path / 'leaves.npy')
    for other in (outside, folder / 'models.npz'):
        leaves.unlink()
        leaves.symlink_to(other)
        _rejected(install, 'points outside')


def _replace(folder, file, write):
    """Write a file anew and enter its true size and checksum into model.json."""
    write(folder / file)
    data = (folder / file).read_bytes()
    _edit(folder, lambda meta: meta['files'].update(
        {file: {'bytes': len(data), 'sha256': hashlib.sha256(data).hexdigest()}}))


def test_pickles_are_rejected(folder, tmp_path):
    class Evil:
        def __reduce__(self):
            return (open, (str(tmp_path / 'was_run'), 'w'))

    _replace(folder, 'classifier/leaves.npy', lambda path: np.save(
        path, np.array([Evil()], object), allow_pickle=True))
    _rejected(folder, 'leaves.npy is not an array of plain numbers')
    _replace(folder, 'classifier/leaves.npy', lambda path: np.save(path, np.arange(20)))
    load_model_folder(folder)
    _replace(folder, 'models.npz', lambda path: np.savez(
        path, extents=np.array([Evil()], object)))
    _rejected(folder, 'models.npz is not what hooc train writes')
    assert not (tmp_path / 'was_run').exists()


@pytest.mark.parametrize('key, spoil', [
    ('faces', lambda a: a + 10**6), ('faces', lambda a: a - 1), ('vertices', lambda a: a[:-1]),
    ('vertices', lambda a: a * np.nan), ('extents', lambda a: a * 0),
    ('surface_points', lambda a: a[:1]), ('surface_points', lambda a: a[..., :2]),
    ('interior_points', lambda a: a.astype(complex)), ('symmetry', lambda a: a.astype(float)),
    ('vertices_count', lambda a: -a), ('volume', None)])
def test_arrays_that_would_lead_compiled_code_astray(folder, key, spoil):
    def write(path):
        arrays = dict(np.load(path))
        if spoil is None:
            del arrays[key]
        else:
            arrays[key] = spoil(arrays[key])
        np.savez(path, **arrays)
    _replace(folder, 'models.npz', write)
    _rejected(folder, 'models.npz is not what hooc train writes')


@pytest.mark.parametrize('content', [b'', b'PK junk', b'\x93NUMPY\x01\x00\x10\x00{"descr": 1}'])
def test_arrays_that_are_none(folder, content):
    _replace(folder, 'classifier/leaves.npy', lambda path: path.write_bytes(content))
    _rejected(folder, 'leaves.npy')
    _replace(folder, 'models.npz', lambda path: path.write_bytes(content))
    _rejected(folder, 'models.npz')

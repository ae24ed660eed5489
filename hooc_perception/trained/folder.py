# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
The MODEL folder: what `hooc train` leaves and every other command reads. Plain data only.

    model.json              format, name, profile, seed, cameras, categories, checksums
    models.npz              what is derived from the generic models
    meshes/<category>.ply   the cleaned meshes, for viewers
    classifier/<key>.npy    the arrays of the decision forests, mapped into memory when read

Every file is named, with its size and SHA-256, in model.json; reading checks all of them,
unpickles nothing and follows no path out of the folder.
"""

from dataclasses import dataclass, field
import hashlib
import json
import math
import os
from pathlib import Path
import re
import shutil
import tempfile
import zipfile

from hooc_perception.chain import check_categories
from hooc_perception.core.types import Camera, GenericModel
from hooc_perception.errors import HoocError
import numpy as np
import trimesh

FORMAT = 'hooc-model/1'
MAX_JSON_BYTES = 4 * 10**6
MAX_FILE_BYTES = 2 * 10**9
MAX_SIDE = 8192
# What we write is not compressed; 20 times is more than numbers of meshes ever yield.
MAX_RATIO = 20
SAFE_NAME = re.compile(r'[A-Za-z0-9_][A-Za-z0-9_.-]{0,99}')
# GenericModel fields of the same shape for every model are stacked, the others joined.
STACKED = ('extents', 'surface_points', 'surface_normals', 'interior_points', 'volume',
           'symmetry')
JOINED = ('vertices', 'faces', 'rest_rotations', 'rest_probability')


@dataclass(frozen=True)
class ModelFolder:
    """
    A trained model as read from its folder.

    :ivar models: tuple of GenericModel; class id c is models[c - 1].
    :ivar classifier: dict of arrays, as core.classification.classify wants it.
    :ivar cameras: tuple of Camera that it was trained for.
    :ivar max_instances: objects of one category in a scene at most, 0 = no limit.
    :ivar mesh_sha256: category name -> hex SHA-256 of its mesh file.
    """

    path: Path
    name: str
    models: tuple
    classifier: dict
    profile: str
    seed: int
    cameras: tuple
    max_instances: int = 0
    mesh_sha256: dict = field(default_factory=dict)

    def mesh_path(self, category):
        """Return the path of a category's cleaned mesh."""
        return self.path / 'meshes' / f'{category}.ply'


def save_model_folder(path, name, models, classifier, profile, seed, cameras, max_instances=0):
    """
    Write a MODEL folder as a whole or not at all, and return it as ModelFolder.

    An older MODEL folder at `path` is replaced; anything else there is left alone.

    :raises HoocError: the path is taken, a name is unfit for a file, two categories would share
        a topic, or an array is no numbers.
    """
    path = Path(path)
    check_place(path, [model.name for model in models])
    for item in classifier:
        _check_name(item, path)
    path.parent.mkdir(parents=True, exist_ok=True)
    building = Path(tempfile.mkdtemp(prefix=f'.{path.name}-', dir=path.parent))
    try:
        _write(building, name, models, classifier, profile, seed, cameras, max_instances)
        building.chmod(0o755)
        if path.exists():
            old = Path(tempfile.mkdtemp(prefix=f'.{path.name}-old-', dir=path.parent))
            os.replace(path, old / 'was')
            os.replace(building, path)
            shutil.rmtree(old)
        else:
            os.replace(building, path)
    finally:
        shutil.rmtree(building, ignore_errors=True)
    return load_model_folder(path)


def check_place(path, names):
    """
    Raise HoocError where no MODEL folder of these categories can be written at `path`.

    Training asks before it begins.
    """
    path = Path(path)
    if path.exists() and not (path / 'model.json').is_file() and not (
            path.is_dir() and not any(path.iterdir())):
        raise HoocError(f'{path} exists and is not a model folder; name another one')
    seen = {}
    for name in names:
        _check_name(name, path)
        if name.lower() in seen:
            raise HoocError(f'the categories {seen[name.lower()]!r} and {name!r} would share a '
                            f'file in {path} on systems that take no notice of case; rename one')
        seen[name.lower()] = name
    check_categories(names, path)


def load_model_folder(path):
    """
    Return the ModelFolder at `path`.

    :raises HoocError: not a model folder, another format version, a file that is missing,
        damaged, outside the folder or not plain numbers.
    """
    path = Path(path)
    meta = _read_meta(path)
    try:
        files = {str(k): (int(v['bytes']), str(v['sha256'])) for k, v in meta['files'].items()}
        names = [str(n) for n in meta['categories']]
        keys = [str(k) for k in meta['classifier']]
        cameras = tuple(_camera_from_dict(c) for c in meta['cameras'])
        general = (str(meta['name']), str(meta['profile']), int(meta['seed']),
                   int(meta['max_instances']))
    except (KeyError, TypeError, ValueError, AttributeError) as e:
        raise HoocError(f'{path}/model.json lacks or garbles the field {e}; train again') from e
    for item in [*names, *keys]:
        _check_name(item, path)
    check_categories(names, f'{path}/model.json')
    wanted = ['models.npz', *(f'meshes/{n}.ply' for n in names),
              *(f'classifier/{k}.npy' for k in keys)]
    for file in wanted:
        _check_file(path, file, files)
    models = _read_models(path / 'models.npz', names)
    classifier = {k: _read_array(path / 'classifier' / f'{k}.npy') for k in keys}
    name, profile, seed, max_instances = general
    return ModelFolder(path, name, models, classifier, profile, seed, cameras, max_instances,
                       {n: files[f'meshes/{n}.ply'][1] for n in names})


def _write(folder, name, models, classifier, profile, seed, cameras, max_instances):
    """Write all files of a MODEL folder into an empty folder, model.json last."""
    (folder / 'meshes').mkdir()
    (folder / 'classifier').mkdir()
    for model in models:
        mesh = trimesh.Trimesh(model.vertices, model.faces, process=False)
        mesh.export(folder / 'meshes' / f'{model.name}.ply')
    arrays = {key: np.stack([np.asarray(getattr(m, key)) for m in models]) for key in STACKED}
    for key in JOINED:
        arrays[key] = np.concatenate([getattr(m, key) for m in models])
        arrays[f'{key}_count'] = np.array([len(getattr(m, key)) for m in models], np.int64)
    np.savez(folder / 'models.npz', **arrays)
    for key, array in classifier.items():
        array = np.ascontiguousarray(array) if np.ndim(array) else np.asarray(array)
        if array.dtype.kind not in 'biufU':
            raise HoocError(f'classifier array {key} holds {array.dtype}, not plain numbers')
        np.save(folder / 'classifier' / f'{key}.npy', array, allow_pickle=False)
    files = sorted(p for p in folder.rglob('*') if p.is_file())
    meta = {'format': FORMAT, 'name': name, 'profile': profile, 'seed': int(seed),
            'max_instances': int(max_instances), 'categories': [m.name for m in models],
            'classifier': list(classifier), 'cameras': [_camera_to_dict(c) for c in cameras],
            'files': {p.relative_to(folder).as_posix(): {'bytes': p.stat().st_size,
                                                         'sha256': _sha256(p)} for p in files}}
    (folder / 'model.json').write_text(json.dumps(meta, indent=1) + '\n', encoding='utf-8')


def _read_meta(path):
    """Return model.json as a dict of the right format, or raise HoocError."""
    file = path / 'model.json'
    if not file.is_file():
        raise HoocError(f'{path} is not a model folder (it has no model.json); make one with '
                        'hooc train')
    if file.stat().st_size > MAX_JSON_BYTES:
        raise HoocError(f'{file} is too large to be true; train again')
    try:
        meta = json.loads(file.read_text(encoding='utf-8'))
    except (ValueError, RecursionError) as e:
        raise HoocError(f'{file} is not valid JSON ({_reason(e)}); train again') from e
    found = meta.get('format') if isinstance(meta, dict) else None
    if found != FORMAT:
        raise HoocError(f'{file} has the format {found!r}, but this version reads {FORMAT}; '
                        'train again')
    return meta


def _check_name(name, path):
    """Raise HoocError where a name could not be a plain file name."""
    if not SAFE_NAME.fullmatch(str(name)):
        raise HoocError(f'{path} holds the name {str(name)[:60]!r}; use letters, digits, _ . -')


def _check_file(folder, name, files):
    """Raise HoocError unless the file is inside the folder, as long and as summed as declared."""
    if name not in files:
        raise HoocError(f'{folder}/model.json does not list {name}; train again')
    file, (size, digest) = folder / name, files[name]
    if not file.is_file():
        raise HoocError(f'{file} is missing; copy the whole model folder or train again')
    if not file.resolve().is_relative_to(folder.resolve()):
        raise HoocError(f'{file} points outside the model folder; copy the file itself')
    if not size == file.stat().st_size <= MAX_FILE_BYTES or _sha256(file) != digest:
        raise HoocError(f'{file} is damaged (its checksum differs from model.json); copy it '
                        'again or train again')


def _sha256(file):
    """Return the hex SHA-256 of a file."""
    with open(file, 'rb') as stream:
        return hashlib.file_digest(stream, 'sha256').hexdigest()


def _read_array(file):
    """Return one .npy array, mapped copy-on-write: writing to it leaves the file alone."""
    try:
        array = np.load(file, mmap_mode='c', allow_pickle=False)
    except Exception as e:      # numpy fails on a stranger's bytes in many ways
        raise HoocError(f'{file} is not an array of plain numbers ({_reason(e)}); '
                        'train again') from e
    if array.dtype.kind not in 'biufU':
        raise HoocError(f'{file} holds {array.dtype}, not plain numbers; train again')
    # numba compiles a np.memmap separately from an array; a view is just an array.
    return array.view(np.ndarray)


def _read_models(file, names):
    """Return the tuple of GenericModel in models.npz, its shapes and indices checked."""
    try:
        with zipfile.ZipFile(file) as archive:
            size = sum(info.file_size for info in archive.infolist())
            if size > min(MAX_FILE_BYTES, MAX_RATIO * file.stat().st_size):
                raise ValueError('its contents are too large')
            for info in archive.infolist():
                _check_header(archive, info)
        with np.load(file, allow_pickle=False) as archive:
            data = {key: archive[key] for key in archive.files}
        n = len(names)
        for key in STACKED:
            if len(data[key]) != n:
                raise ValueError(f'{key} has {len(data[key])} rows for {n} categories')
        parts = {}
        for key in JOINED:
            count = data[f'{key}_count']
            if count.shape != (n,) or (count < 0).any() or count.sum() != len(data[key]):
                raise ValueError(f'{key} does not add up')
            parts[key] = np.split(data[key], np.cumsum(count)[:-1])
        models = tuple(
            GenericModel(name=name, **{k: data[k][i] for k in STACKED if k != 'volume'},
                         volume=float(data['volume'][i]), **{k: parts[k][i] for k in JOINED})
            for i, name in enumerate(names))
        for model in models:
            _check_model(model)
    except Exception as e:      # zipfile and numpy fail on a stranger's bytes in many ways
        raise HoocError(f'{file} is not what hooc train writes ({_reason(e)}); '
                        'train again') from e
    return models


def _reason(error):
    """Return the short text of an exception, in one line."""
    return ' '.join(str(error).split())[:160] or type(error).__name__


def _check_header(archive, info):
    """Raise ValueError where an array says that it is larger than it is: numpy trusts it."""
    with archive.open(info) as stream:
        version = np.lib.format.read_magic(stream)
        read = {(1, 0): np.lib.format.read_array_header_1_0,
                (2, 0): np.lib.format.read_array_header_2_0}.get(version)
        if read is None:
            raise ValueError(f'{info.filename} has a header of version {version}')
        shape, _, dtype = read(stream)
        if dtype.hasobject or math.prod(shape) * dtype.itemsize > info.file_size:
            raise ValueError(f'{info.filename} is no array of the size that it says')


def _check_model(model):
    """Raise ValueError where an array would make compiled code read outside of its bounds."""
    def shaped(key, *tail, kind='f'):
        array = getattr(model, key)
        if array.shape[1:] != tail or array.ndim != 1 + len(tail) or array.dtype.kind != kind:
            raise ValueError(f'{key} of {model.name} has the shape {array.shape}')
        if kind == 'f' and not np.isfinite(array).all():
            raise ValueError(f'{key} of {model.name} is not finite')
        return array

    for key in ('vertices', 'surface_points', 'surface_normals', 'interior_points'):
        shaped(key, 3)
    shaped('rest_rotations', 4), shaped('rest_probability')
    shaped('extents'), shaped('symmetry', kind='i')
    faces = shaped('faces', 3, kind='i')
    if len(model.extents) != 3 or len(model.symmetry) != 3 or not np.isfinite(model.volume):
        raise ValueError(f'extents, symmetry or volume of {model.name} are garbled')
    if len(faces) == 0 or faces.min() < 0 or faces.max() >= len(model.vertices):
        raise ValueError(f'faces of {model.name} name vertices that are not there')
    if not (model.extents > 0).all() or len(model.rest_rotations) != len(model.rest_probability):
        raise ValueError(f'extents or resting poses of {model.name} are garbled')


def _camera_to_dict(camera):
    """Return a Camera as plain lists and numbers."""
    return {'name': camera.name, 'width': int(camera.width), 'height': int(camera.height),
            'distortion_model': camera.distortion_model,
            'K': np.asarray(camera.K, float).ravel().tolist(),
            'D': np.asarray(camera.D, float).tolist(),
            'T_world_camera': np.asarray(camera.T_world_camera, float).ravel().tolist()}


def _camera_from_dict(data):
    """Return the Camera of such a dict; ValueError where a number is missing or not finite."""
    K = np.array(data['K'], np.float64).reshape(3, 3)
    D = np.array(data['D'], np.float64).reshape(-1)
    T = np.array(data['T_world_camera'], np.float64).reshape(4, 4)
    if not (np.isfinite(K).all() and np.isfinite(D).all() and np.isfinite(T).all()):
        raise ValueError('cameras')
    width, height = int(data['width']), int(data['height'])
    if not (0 < width <= MAX_SIDE and 0 < height <= MAX_SIDE and K[0, 0] > 0 and K[1, 1] > 0):
        raise ValueError('cameras')
    return Camera(str(data['name']), width, height, K, D, T, str(data['distortion_model']))

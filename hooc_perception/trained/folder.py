# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
The MODEL folder: the output of `hooc train` and the input of every other command.

    model.json              format, name, profile, seed, cameras, categories, checksums
    models.npz              everything derived from the generic models
    meshes/<category>.ply   the cleaned generic meshes, for viewers; those of the further
                            members of a family are <category>.1.ply, <category>.2.ply, ...
    classifier/<key>.npy    the arrays of the decision forests, memory-mapped when read

It holds plain data only. Every file is listed with its size and SHA-256 in model.json; reading
checks all of them, unpickles nothing and follows no path out of the folder. Links are followed
where the folder mirrors another MODEL folder file by file, its model.json included.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
import os
from pathlib import Path
import shutil
import tempfile

from hooc_perception.chain import check_categories
from hooc_perception.core.arrays import AnyArray
from hooc_perception.core.types import Camera, GenericModel
from hooc_perception.errors import HoocError
from hooc_perception.trained.integrity import (
    check_file,
    check_name,
    FILE_NAME,
    load_plain_array,
    PLAIN_KINDS,
)
from hooc_perception.trained.metadata import (
    file_records,
    Metadata,
    read_metadata,
    write_metadata,
)
from hooc_perception.trained.models_file import read_models, write_models
import numpy as np


@dataclass(frozen=True)
class ModelFolder:
    """
    A trained model as read from its folder.

    :ivar models: class id c is models[c - 1].
    :ivar classifier: named arrays, the input of core.classification.classify.
    :ivar cameras: the cameras that it was trained for.
    :ivar max_instances: most objects of one category in a scene, 0 = no limit.
    :ivar mesh_sha256: name of a mesh file without its ending, such as `pan` and `pan.1` -> its
        hex SHA-256.
    """

    path: Path
    name: str
    models: tuple[GenericModel, ...]
    classifier: dict[str, AnyArray]
    profile: str
    seed: int
    cameras: tuple[Camera, ...]
    max_instances: int = 0
    mesh_sha256: dict[str, str] = field(default_factory=dict)

    def mesh_path(self, category: str, member: int = 0) -> Path:
        """Return the path of a category's cleaned mesh; `member` is its place in the family."""
        return self.path / _mesh_file(_mesh_name(category, member))

    def mesh_of(self, category: str, member: int = 0) -> tuple[Path, str]:
        """Return (path, hex SHA-256) of a member of a category's family."""
        return self.mesh_path(category, member), self.mesh_sha256[_mesh_name(category, member)]


def save_model_folder(path: str | Path, name: str, models: Sequence[GenericModel],
                      classifier: Mapping[str, AnyArray], profile: str, seed: int,
                      cameras: Sequence[Camera], max_instances: int = 0) -> ModelFolder:
    """
    Write a MODEL folder atomically and return it as ModelFolder.

    An older MODEL folder at `path` is replaced; anything else there is left alone.

    :raises HoocError: if the path is taken, a name is unfit for a file, two categories would
        share a file or a topic, or an array does not hold plain numbers.
    """
    path = Path(path)
    check_place(path, [model.name for model in models])
    for item in classifier:
        check_name(item, path)
    path.parent.mkdir(parents=True, exist_ok=True)
    building = Path(tempfile.mkdtemp(prefix=f'.{path.name}-', dir=path.parent))
    try:
        _write_data(building, models, classifier)
        write_metadata(building, Metadata(
            name, profile, seed, max_instances, tuple(m.name for m in models), tuple(classifier),
            tuple(cameras), file_records(building)))
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


def check_place(path: str | Path, names: Sequence[str]) -> None:
    """
    Raise HoocError if no MODEL folder of these categories can be written at `path`.

    Training calls this before it begins.
    """
    path = Path(path)
    if path.exists() and not (path / FILE_NAME).is_file() and not (
            path.is_dir() and not any(path.iterdir())):
        raise HoocError(f'{path} exists and is not a model folder; name another one')
    seen: dict[str, str] = {}
    for name in names:
        check_name(name, path)
        if name.lower() in seen:
            raise HoocError(f'the categories {seen[name.lower()]!r} and {name!r} would share a '
                            f'file in {path} on case-insensitive file systems; rename one')
        seen[name.lower()] = name
    for low, name in seen.items():
        stem, _, number = low.rpartition('.')
        if number.isdecimal() and stem in seen:
            raise HoocError(f'the category {name!r} and a further mesh of {seen[stem]!r} would '
                            f'share a file in {path}; rename one of them')
    check_categories(names, str(path))


def load_model_folder(path: str | Path) -> ModelFolder:
    """
    Return the ModelFolder at `path`.

    :raises HoocError: if it is not a model folder, has another format version, or a file is
        missing, damaged, outside the folder or not plain numbers.
    """
    path = Path(path)
    meta = read_metadata(path)
    for file in ('models.npz', *map(_mesh_file, meta.categories),
                 *map(_array_file, meta.classifier_keys)):
        check_file(path, file, meta.files)
    models = read_models(path / 'models.npz', meta.categories)
    meshes = [_mesh_name(model.name, k) for model in models for k in range(len(model.members))]
    for mesh in meshes:
        if mesh not in meta.categories:
            check_file(path, _mesh_file(mesh), meta.files)
    classifier = {key: load_plain_array(path / _array_file(key)) for key in meta.classifier_keys}
    return ModelFolder(path, meta.name, models, classifier, meta.profile, meta.seed, meta.cameras,
                       meta.max_instances,
                       {mesh: meta.files[_mesh_file(mesh)].sha256 for mesh in meshes})


def _write_data(folder: Path, models: Sequence[GenericModel],
                classifier: Mapping[str, AnyArray]) -> None:
    """Write all files of a MODEL folder but model.json into an empty folder."""
    # Imported late: only training writes meshes.
    import trimesh
    (folder / 'meshes').mkdir()
    (folder / 'classifier').mkdir()
    for model in models:
        for k, member in enumerate(model.members):
            mesh = trimesh.Trimesh(member.vertices, member.faces, process=False)
            mesh.export(folder / _mesh_file(_mesh_name(model.name, k)))
    write_models(folder / 'models.npz', models)
    for key, array in classifier.items():
        array = np.ascontiguousarray(array) if np.ndim(array) else np.asarray(array)
        if array.dtype.kind not in PLAIN_KINDS:
            raise HoocError(f'classifier array {key} holds {array.dtype}, not plain numbers; '
                            'give arrays of numbers')
        np.save(folder / _array_file(key), array, allow_pickle=False)


def _mesh_name(category: str, member: int) -> str:
    """Return the name of the mesh of a member of a category's family."""
    return f'{category}.{member}' if member else category


def _mesh_file(mesh: str) -> str:
    """Return the path of a mesh relative to the folder."""
    return f'meshes/{mesh}.ply'


def _array_file(key: str) -> str:
    """Return the path of a classifier array relative to the folder."""
    return f'classifier/{key}.npy'

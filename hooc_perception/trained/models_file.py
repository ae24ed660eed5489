# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The file models.npz of a MODEL folder: everything derived from the generic models."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from hooc_perception.core.arrays import AnyArray
from hooc_perception.core.types import GenericModel
from hooc_perception.errors import HoocError
from hooc_perception.trained.integrity import load_plain_archive, short_reason
import numpy as np

# GenericModel fields of the same shape for every model are stacked, the others concatenated.
STACKED = ('extents', 'surface_points', 'surface_normals', 'interior_points', 'volume',
           'symmetry')
JOINED = ('vertices', 'faces', 'rest_rotations', 'rest_probability')


def write_models(file: Path, models: Sequence[GenericModel]) -> None:
    """Write models.npz; the members of each family follow one another."""
    members = [len(model.members) for model in models]
    models = [member for model in models for member in model.members]
    arrays: dict[str, AnyArray] = {'members': np.array(members, np.int64)}
    arrays |= {
        key: np.stack([np.asarray(_fields(m)[key]) for m in models]) for key in STACKED}
    for key in JOINED:
        arrays[key] = np.concatenate([_fields(m)[key] for m in models])
        arrays[f'{key}_count'] = np.array([len(_fields(m)[key]) for m in models], np.int64)
    # The stub mistakes the arrays' names for the parameter allow_pickle of newer versions.
    np.savez(file, **arrays)  # pyright: ignore[reportArgumentType]


def read_models(file: Path, names: Sequence[str]) -> tuple[GenericModel, ...]:
    """Return the models in models.npz after checking shapes and indices; `names` in order."""
    try:
        data = load_plain_archive(file)
        # Folders from before there were families have one mesh per category.
        members = data.get('members', np.ones(len(names), np.int64))
        n = len(data['extents'])
        if members.shape != (len(names),) or members.dtype.kind != 'i' or (
                members.min(initial=1) < 1 or members.max(initial=1) > n or members.sum() != n):
            raise ValueError('the families do not add up')
        names = [name for name, count in zip(names, members) for _ in range(count)]
        for key in STACKED:
            if len(data[key]) != n:
                raise ValueError(f'{key} has {len(data[key])} rows for {n} meshes')
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
        first = np.cumsum(members) - members
        models = tuple(replace(models[k], variants=models[k + 1:k + count])
                       for k, count in zip(first, members))
    except Exception as e:      # zipfile and numpy fail on damaged bytes in many ways
        raise HoocError(f'{file} is not what hooc train writes ({short_reason(e)}); '
                        'train again') from e
    return models


def _fields(model: GenericModel) -> dict[str, AnyArray]:
    """Return the fields of a GenericModel that are written, by name."""
    return {'extents': model.extents, 'surface_points': model.surface_points,
            'surface_normals': model.surface_normals, 'interior_points': model.interior_points,
            'volume': np.asarray(model.volume), 'symmetry': model.symmetry,
            'vertices': model.vertices, 'faces': model.faces,
            'rest_rotations': model.rest_rotations, 'rest_probability': model.rest_probability}


def _check_model(model: GenericModel) -> None:
    """Raise ValueError if an array would make compiled code read outside its bounds."""
    arrays = _fields(model)
    for key, tail, kind in (
            ('vertices', (3,), 'f'), ('surface_points', (3,), 'f'), ('surface_normals', (3,), 'f'),
            ('interior_points', (3,), 'f'), ('rest_rotations', (4,), 'f'),
            ('rest_probability', (), 'f'), ('extents', (), 'f'), ('symmetry', (), 'i'),
            ('faces', (3,), 'i')):
        array = arrays[key]
        if array.shape[1:] != tail or array.ndim != 1 + len(tail) or array.dtype.kind != kind:
            raise ValueError(f'{key} of {model.name} has the shape {array.shape}')
        if kind == 'f' and not np.isfinite(array).all():
            raise ValueError(f'{key} of {model.name} is not finite')
    faces = model.faces
    if len(model.extents) != 3 or len(model.symmetry) != 3 or not np.isfinite(model.volume):
        raise ValueError(f'extents, symmetry or volume of {model.name} are garbled')
    if len(faces) == 0 or faces.min() < 0 or faces.max() >= len(model.vertices):
        raise ValueError(f'faces of {model.name} name vertices that do not exist')
    if not (model.extents > 0).all() or len(model.rest_rotations) != len(model.rest_probability):
        raise ValueError(f'extents or resting poses of {model.name} are garbled')

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The file model.json of a MODEL folder: names, cameras, settings and checksums."""

from dataclasses import dataclass
import json
from pathlib import Path
from typing import Any

from hooc_perception.chain import check_categories
from hooc_perception.core.types import Camera
from hooc_perception.errors import HoocError
from hooc_perception.trained.integrity import (
    check_name,
    FILE_NAME,
    FileRecord,
    sha256_of,
    short_reason,
)
import numpy as np

FORMAT = 'hooc-model/1'
MAX_JSON_BYTES = 4 * 10**6
MAX_SIDE = 8192


@dataclass(frozen=True)
class Metadata:
    """
    Content of model.json.

    :ivar categories: in the order of the class ids.
    :ivar classifier_keys: names of the classifier's arrays.
    :ivar files: {path relative to the folder: size and checksum}.
    """

    name: str
    profile: str
    seed: int
    max_instances: int
    categories: tuple[str, ...]
    classifier_keys: tuple[str, ...]
    cameras: tuple[Camera, ...]
    files: dict[str, FileRecord]


def file_records(folder: Path) -> dict[str, FileRecord]:
    """Return {relative path: size and checksum} of all files in a folder."""
    files = sorted(p for p in folder.rglob('*') if p.is_file())
    return {p.relative_to(folder).as_posix(): FileRecord(p.stat().st_size, sha256_of(p))
            for p in files}


def write_metadata(folder: Path, meta: Metadata) -> None:
    """Write model.json."""
    content = {'format': FORMAT, 'name': meta.name, 'profile': meta.profile,
               'seed': int(meta.seed), 'max_instances': int(meta.max_instances),
               'categories': list(meta.categories), 'classifier': list(meta.classifier_keys),
               'cameras': [_camera_to_dict(c) for c in meta.cameras],
               'files': {file: {'bytes': record.size, 'sha256': record.sha256}
                         for file, record in meta.files.items()}}
    (folder / FILE_NAME).write_text(json.dumps(content, indent=1) + '\n', encoding='utf-8')


def read_metadata(folder: Path) -> Metadata:
    """Return the checked content of model.json; HoocError if it is missing or damaged."""
    content = _read_json(folder)
    try:
        files = {str(k): FileRecord(int(v['bytes']), str(v['sha256']))
                 for k, v in content['files'].items()}
        categories = tuple(str(n) for n in content['categories'])
        keys = tuple(str(k) for k in content['classifier'])
        cameras = tuple(_camera_from_dict(c) for c in content['cameras'])
        meta = Metadata(str(content['name']), str(content['profile']), int(content['seed']),
                        int(content['max_instances']), categories, keys, cameras, files)
    except (KeyError, TypeError, ValueError, AttributeError) as e:
        raise HoocError(f'{folder}/{FILE_NAME} lacks or garbles the field {e}; train again') from e
    for item in (*meta.categories, *meta.classifier_keys):
        check_name(item, folder)
    check_categories(meta.categories, f'{folder}/{FILE_NAME}')
    return meta


def _read_json(folder: Path) -> dict[str, Any]:
    """Return model.json as a dict of the right format, or raise HoocError."""
    file = folder / FILE_NAME
    if not file.is_file():
        raise HoocError(f'{folder} is not a model folder (it has no {FILE_NAME}); make one with '
                        'hooc train')
    if file.stat().st_size > MAX_JSON_BYTES:
        raise HoocError(f'{file} has more than {MAX_JSON_BYTES} bytes, so it is damaged; train '
                        'again')
    try:
        content = json.loads(file.read_text(encoding='utf-8'))
    except (ValueError, RecursionError) as e:
        raise HoocError(f'{file} is not valid JSON ({short_reason(e)}); train again') from e
    found = content.get('format') if isinstance(content, dict) else None
    if found != FORMAT:
        raise HoocError(f'{file} has the format {found!r}, but this version reads {FORMAT}; '
                        'train again')
    return content


def _camera_to_dict(camera: Camera) -> dict[str, Any]:
    """Return a Camera as plain lists and numbers."""
    return {'name': camera.name, 'width': int(camera.width), 'height': int(camera.height),
            'distortion_model': camera.distortion_model,
            'K': np.asarray(camera.K, float).ravel().tolist(),
            'D': np.asarray(camera.D, float).tolist(),
            'T_world_camera': np.asarray(camera.T_world_camera, float).ravel().tolist()}


def _camera_from_dict(data: dict[str, Any]) -> Camera:
    """Return the Camera of such a dict; ValueError if a number is missing or not finite."""
    K = np.array(data['K'], np.float64).reshape(3, 3)
    D = np.array(data['D'], np.float64).reshape(-1)
    T = np.array(data['T_world_camera'], np.float64).reshape(4, 4)
    if not (np.isfinite(K).all() and np.isfinite(D).all() and np.isfinite(T).all()):
        raise ValueError('cameras')
    width, height = int(data['width']), int(data['height'])
    if not (0 < width <= MAX_SIDE and 0 < height <= MAX_SIDE and K[0, 0] > 0 and K[1, 1] > 0):
        raise ValueError('cameras')
    return Camera(str(data['name']), width, height, K, D, T, str(data['distortion_model']))

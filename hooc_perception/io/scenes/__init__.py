# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Scene sets, BOP datasets, camera calibrations and results files."""

from importlib import import_module
from typing import Any, TYPE_CHECKING

if TYPE_CHECKING:
    from hooc_perception.io.scenes.results import load_results, write_results
    from hooc_perception.io.scenes.scene import Category, RecordedScene, TrueObject
    from hooc_perception.io.scenes.scene_set import load_scene_set, SceneSet
    from hooc_perception.io.scenes.sequences import RecordedSequence
    from hooc_perception.io.scenes.writer import NewScene, write_scene_set

__all__ = ['Category', 'NewScene', 'RecordedScene', 'RecordedSequence', 'SceneSet', 'TrueObject',
           'load_results', 'load_scene_set', 'write_results', 'write_scene_set']

_MODULES = {'Category': 'scene', 'NewScene': 'writer', 'RecordedScene': 'scene',
            'RecordedSequence': 'sequences', 'SceneSet': 'scene_set', 'TrueObject': 'scene',
            'load_results': 'results', 'load_scene_set': 'scene_set', 'write_results': 'results',
            'write_scene_set': 'writer'}


def __getattr__(name: str) -> Any:
    """Import public names on first use: importing `files` alone must not import OpenCV."""
    if name not in _MODULES:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    return getattr(import_module(f'{__name__}.{_MODULES[name]}'), name)

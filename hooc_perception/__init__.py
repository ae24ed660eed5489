# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Categories, 6D poses and sizes of all objects on a table, from depth images alone.

    from hooc_perception import Camera, DepthView, Parser

    scene = Parser.load('models/demo').parse([DepthView(camera, depth), ...])

Importing the package costs nothing: the names below are loaded when they are first used.
"""

from importlib import import_module
from typing import Any, TYPE_CHECKING

if TYPE_CHECKING:
    from hooc_perception.core.types import Camera, DepthView
    from hooc_perception.errors import HoocError
    from hooc_perception.parser import Parser
    from hooc_perception.scene import Scene, SceneObject

__all__ = ['Camera', 'DepthView', 'HoocError', 'Parser', 'Scene', 'SceneObject', '__version__']

__version__: str

_HOMES = {'Camera': 'core.types', 'DepthView': 'core.types', 'HoocError': 'errors',
          'Parser': 'parser', 'Scene': 'scene', 'SceneObject': 'scene'}


def __getattr__(name: str) -> Any:
    """Return a public name, imported now."""
    if name == '__version__':
        from importlib.metadata import version
        return version('hooc_perception')
    if name not in _HOMES:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    return getattr(import_module(f'{__name__}.{_HOMES[name]}'), name)


def __dir__() -> list[str]:
    """Return the public names."""
    return __all__

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Bags of recorded scenes, read and written with rosbags, without a ROS installation."""

from importlib import import_module
from typing import Any, TYPE_CHECKING

if TYPE_CHECKING:
    from hooc_perception.io.bags.files import BagMessage, BagTopic, iter_messages, topics
    from hooc_perception.io.bags.raw_writer import RawBagWriter
    from hooc_perception.io.bags.reader import BagScene
    from hooc_perception.io.bags.salvage import salvage_bag, write_salvaged
    from hooc_perception.io.bags.writer import write_bag

__all__ = ['BagMessage', 'BagScene', 'BagTopic', 'RawBagWriter', 'iter_messages', 'salvage_bag',
           'topics', 'write_bag', 'write_salvaged']

_MODULES = {'BagMessage': 'files', 'BagScene': 'reader', 'BagTopic': 'files',
            'RawBagWriter': 'raw_writer', 'iter_messages': 'files', 'salvage_bag': 'salvage',
            'topics': 'files', 'write_bag': 'writer', 'write_salvaged': 'salvage'}


def __getattr__(name: str) -> Any:
    """Import public names on first use, since each module has its own heavy dependencies."""
    if name not in _MODULES:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    return getattr(import_module(f'{__name__}.{_MODULES[name]}'), name)

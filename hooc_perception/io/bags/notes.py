# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What a user states of a recording beside it: its unit, rectification and world frame."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Generic, TypeVar

from hooc_perception.errors import HoocError
from hooc_perception.io.scenes import fields, files

NAME = 'hooc.yaml'
KEYS = ('depth_unit', 'rectified', 'world_frame')
LEAST_UNIT_M, MOST_UNIT_M = 1e-6, 1.0
T = TypeVar('T')


@dataclass(frozen=True)
class PerCamera(Generic[T]):
    """A value for all cameras, and others for some; None = not stated."""

    common: T | None = None
    own: dict[str, T] = field(default_factory=dict)

    def of(self, camera: str) -> T | None:
        """Return the value of a camera."""
        return self.own.get(camera, self.common)


@dataclass(frozen=True)
class RecordingNotes:
    """
    The content of hooc.yaml.

    :ivar depth_unit: metres per count of 16UC1, or per unit of 32FC1.
    :ivar rectified: whether the images are rectified, so that P holds and not K and D.
    :ivar world_frame: a frame with z up and z = 0 on the table top.
    """

    depth_unit: PerCamera[float] = PerCamera()
    rectified: PerCamera[bool] = PerCamera()
    world_frame: str | None = None


def notes_file(bag: Path) -> Path:
    """Return where the notes of a bag lie: in its folder, or beside its file."""
    return bag / NAME if bag.is_dir() else bag.with_name(f'{bag.name}.{NAME}')


def read_notes(bag: Path) -> RecordingNotes:
    """Return the notes of a bag, empty if it has none; HoocError if they are unusable."""
    path = notes_file(bag)
    if not path.is_file():
        return RecordingNotes()
    entry = fields.closed(files.read_yaml(path), KEYS, str(path))
    world = entry.get('world_frame')
    return RecordingNotes(
        _per_camera(entry.get('depth_unit'), _unit, f'{path}: depth_unit'),
        _per_camera(entry.get('rectified'), _truth, f'{path}: rectified'),
        None if world is None else fields.text(world, f'{path}: world_frame'))


def _per_camera(value: object, check: Callable[[object, str], Any], where: str) -> PerCamera[Any]:
    """Return one value for all cameras, or one per camera."""
    if value is None:
        return PerCamera()
    if isinstance(value, dict):
        return PerCamera(None, {name: check(own, f'{where} of {name}')
                                for name, own in fields.mapping(value, where).items()})
    return PerCamera(check(value, where))


def _unit(value: object, where: str) -> float:
    """Return a unit of depth in metres."""
    unit = fields.number(value, where)
    if not LEAST_UNIT_M <= unit <= MOST_UNIT_M:
        raise HoocError(f'{where} is {unit:g}; give metres per count, such as 0.001 for '
                        'millimetres')
    return unit


def _truth(value: object, where: str) -> bool:
    """Return a truth value."""
    if not isinstance(value, bool):
        raise HoocError(f'{where} is {fields.short_repr(value)}; give true or false')
    return value

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Recorded sequences: scenes of a set that are frame sets of one table over time."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from hooc_perception.errors import HoocError
from hooc_perception.io.scenes import fields, files
from hooc_perception.io.scenes.scene import RecordedScene

KEYS = ('name', 'period_s', 'scenes', 'events')
REMOVED = 'removed'
CHANGES = (REMOVED, 'placed', 'moved')
ARM_IN, ARM_OUT = 'arm in', 'arm out'
# Where a set does not say; `hooc convert` writes single scenes at the same pace.
PERIOD_S = 0.1
LONGEST_PERIOD_S = 3600.0


@dataclass(frozen=True)
class RecordedSequence:
    """
    Frame sets of one table over time.

    :ivar period_s: seconds between two frame sets.
    :ivar scenes: names of the scenes, in the order of time.
    :ivar events: {index of a scene: what it shows for the first time}: 'removed C', 'placed C' or
        'moved C' of a category C; 'arm in', 'arm out'.
    """

    name: str
    period_s: float
    scenes: tuple[str, ...]
    events: dict[int, str] = field(default_factory=dict)

    @property
    def changes(self) -> dict[int, tuple[str, str]]:
        """Return {index of a scene: (one of CHANGES, category)}, without what the arm does."""
        split = {index: event.partition(' ') for index, event in self.events.items()}
        return {index: (verb, category) for index, (verb, _, category) in split.items()
                if verb in CHANGES}


def load_sequences(path: Path, scenes: Sequence[RecordedScene],
                   categories: Collection[str]) -> tuple[RecordedSequence, ...]:
    """
    Return what sequences.yaml of a set names, () where there is no such file.

    :param path: folder of the set; `scenes` and `categories` are its own.
    :raises HoocError: one sentence that names file, field and fix.
    """
    file = path / 'sequences.yaml'
    if not file.is_file():
        return ()
    by_name = {scene.name: scene for scene in scenes}
    found = tuple(_sequence(item, f'{file}: [{i}]', by_name, categories)
                  for i, item in enumerate(files.read_yaml_list(file)))
    for name in fields.unique((sequence.name for sequence in found), str(file)):
        if name in by_name:
            raise HoocError(f'{file}: {name} is the name of a scene, too, and both become the bag '
                            f'{name}; rename the sequence')
    # Results files hold each scene once.
    fields.unique((scene for sequence in found for scene in sequence.scenes), str(file))
    return found


def scenes_named(names: Iterable[str], sequences: Iterable[RecordedSequence]) -> list[str]:
    """Return names of scenes, each once: a sequence's name stands for all of its scenes."""
    inside = {sequence.name: sequence.scenes for sequence in sequences}
    return list(dict.fromkeys(scene for name in names for scene in inside.get(name, (name,))))


def whole_sequences(sequences: Iterable[RecordedSequence],
                    names: Collection[str]) -> tuple[RecordedSequence, ...]:
    """Return the sequences all of whose scenes are among `names`."""
    return tuple(sequence for sequence in sequences if set(sequence.scenes) <= set(names))


def event_index(key: object, count: int, where: str) -> int:
    """Return the key of an event of a sequence of `count` scenes."""
    return fields.integer(key, 0, count - 1, f'{where} events: a key')


def event(value: object, where: str, categories: Collection[str] | None = None) -> str:
    """
    Return the text of an event.

    :param categories: those that it may name, None = any.
    """
    verb, _, category = value.partition(' ') if isinstance(value, str) else ('', '', '')
    if value in (ARM_IN, ARM_OUT):
        return str(value)
    if verb not in CHANGES or not category:
        raise HoocError(f'{where} is {fields.short_repr(value)}; write {", ".join(CHANGES)} with '
                        f'a category, such as "{REMOVED} cup", or {ARM_IN} or {ARM_OUT}')
    if categories is not None and category not in categories:
        near = fields.nearest(category, categories)
        raise HoocError(f'{where} is {fields.short_repr(value)}, but {category[:40]} is not in '
                        'dataset.yaml; add it there or correct the name'
                        + (f' (is {near} meant?)' if near else ''))
    return f'{verb} {category}'


def period(value: object, where: str) -> float:
    """Return the seconds between two frame sets."""
    seconds = fields.number(value, where)
    if not 0 < seconds <= LONGEST_PERIOD_S:
        raise HoocError(f'{where} is {seconds:g}; give the seconds between two frame sets')
    return seconds


def _sequence(item: object, where: str, by_name: Mapping[str, RecordedScene],
              categories: Collection[str]) -> RecordedSequence:
    """Return one sequence of the file; `by_name` are the scenes of the set."""
    item = fields.closed(fields.mapping(item, where), KEYS, where)
    name = fields.name(fields.required(item, 'name', where), f'{where} name')
    scenes = fields.sequence(fields.required(item, 'scenes', where), f'{where} scenes')
    if not scenes:
        raise HoocError(f'{where} scenes is empty; name the frame sets in the order of time')
    for scene in scenes:
        if fields.name(scene, f'{where} scenes') not in by_name:
            near = fields.nearest(scene, by_name)
            raise HoocError(f'{where} scenes names {scene}, but the set has no such scene; add '
                            'its folder or correct the name'
                            + (f' (is {near} meant?)' if near else ''))
    events = {event_index(key, len(scenes), where):
              event(value, f'{where} events: {key}', categories)
              for key, value in fields.mapping(item.get('events') or {},
                                               f'{where} events').items()}
    sequence = RecordedSequence(name, period(item.get('period_s', PERIOD_S), f'{where} period_s'),
                                tuple(scenes), dict(sorted(events.items())))
    _check_changes(sequence, where, by_name)
    return sequence


def _check_changes(sequence: RecordedSequence, where: str,
                   by_name: Mapping[str, RecordedScene]) -> None:
    """Raise HoocError where the ground truth does not hold what an event says has changed."""
    for index, (verb, category) in sequence.changes.items():
        at = index - 1 if verb == REMOVED else index
        if at < 0:
            raise HoocError(f'{where} events: {index} is {verb} {category}, but there is no frame '
                            'set before; give the index of the first one without it')
        truth = by_name[sequence.scenes[at]].source_truth
        if truth is not None and all(true.category != category for true in truth):
            raise HoocError(f'{where} events: {index} is {verb} {category}, but {category} is not '
                            f'in the ground truth of {sequence.scenes[at]}; correct one of them')

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Scenes of the report that are frame sets of one table over time."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

from hooc_perception.evaluation.report.scene import ReportScene
from hooc_perception.io.scenes.sequences import RecordedSequence


@dataclass(frozen=True)
class ReportSequence:
    """
    A sequence, which the page shows as one view with a slider.

    :ivar steps: two or more frame sets, in the order of time.
    :ivar known: {index of a step: what is known to have happened before it}.
    """

    name: str
    steps: tuple[ReportScene, ...]
    known: Mapping[int, str] = field(default_factory=dict)


Shown: TypeAlias = ReportScene | ReportSequence


def in_sequences(scenes: Sequence[ReportScene],
                 sequences: Iterable[RecordedSequence]) -> list[Shown]:
    """
    Return what the page shows: sequences instead of their scenes, where these first come.

    A sequence of which there is only one scene is that scene.
    """
    by_name = {scene.name: scene for scene in scenes}
    of_scene: dict[str, ReportSequence] = {}
    for sequence in sequences:
        there = [k for k, name in enumerate(sequence.scenes) if name in by_name]
        if len(there) > 1:
            of_scene |= dict.fromkeys((sequence.scenes[k] for k in there), ReportSequence(
                sequence.name, tuple(by_name[sequence.scenes[k]] for k in there),
                {step: sequence.events[k] for step, k in enumerate(there)
                 if k in sequence.events}))
    shown: list[Shown] = []
    for scene in scenes:
        one = of_scene.get(scene.name, scene)
        if not any(one is other for other in shown):
            shown.append(one)
    return shown


def scenes_of(shown: Iterable[Shown]) -> list[ReportScene]:
    """Return all scenes, those of sequences in the order of time."""
    return [scene for one in shown
            for scene in (one.steps if isinstance(one, ReportSequence) else (one,))]


def whens(sequence: ReportSequence) -> list[str]:
    """Return in words which frame set each step is: number, scene, stamp, seconds passed."""
    stamps = [scene.stamp_ns for scene in sequence.steps]
    out = []
    for number, (scene, stamp) in enumerate(zip(sequence.steps, stamps), 1):
        words = [f'frame set {number} of {len(stamps)}', scene.name]
        if stamp is not None:
            seconds, rest = divmod(stamp, 10 ** 9)
            words.append(f'stamp {seconds}.{rest:09d} s')
            if stamps[0] is not None:
                words.append(f'+{(stamp - stamps[0]) * 1e-9:.2f} s')
        out.append(' · '.join(words))
    return out

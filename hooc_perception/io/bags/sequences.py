# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Bags that hold a recorded sequence: all of its frame sets, each as a scene of its own."""

from collections.abc import Mapping

from hooc_perception.core.types import DepthView
from hooc_perception.errors import HoocError
from hooc_perception.io.bags.reader import BagScene
from hooc_perception.io.scenes.scene import TrueObject
from hooc_perception.io.scenes.sequences import RecordedSequence


class BagFrameSet(BagScene):
    """
    One frame set of a sequence in a bag, with the interface of RecordedScene.

    :ivar name: of the scene that it was.
    """

    def __init__(self, bag: BagScene, name: str, truth: tuple[TrueObject, ...] | None,
                 images: Mapping[str, int]) -> None:
        """
        Take over everything that the frame sets of a bag share.

        :param images: {camera: which of its images, from 0 on}.
        """
        # What all frame sets share has been read and checked; the views of the bag have not.
        vars(self).update(vars(bag))
        vars(self).pop('_first_views', None)
        self.name = name
        self.info = {**bag.info, 'scene': name, 'truth': truth, 'sequence': None}
        self._images = images

    def source_views(self) -> tuple[DepthView, ...]:
        """Return the DepthViews of this frame set with the cameras of the source world."""
        return self._views_of(self._images, exactly=True)


def recorded_sequence(bag: BagScene) -> RecordedSequence | None:
    """Return the sequence that a bag says it holds, None for other bags."""
    told = bag.info['sequence']
    return told and RecordedSequence(bag.name, told['period_s'], tuple(told['frame_sets']),
                                     told['events'])


def frame_sets(bag: BagScene) -> tuple[BagFrameSet, ...]:
    """
    Return the frame sets of the sequence in a bag, () for other bags.

    :raises HoocError: if a camera has more or fewer images than the sequence has frame sets.
    """
    told = bag.info['sequence']
    if told is None:
        return ()
    truths = told['frame_sets']
    for topic in bag.depth_topics.values():
        count = bag.topics[topic].count
        if count != len(truths):
            raise HoocError(f'{bag.path}: {topic} has {count} images, but the sequence '
                            f'{bag.name} has {len(truths)} frame sets; convert the set again')
    return tuple(BagFrameSet(bag, name, truth, dict.fromkeys(bag.depth_topics, index))
                 for index, (name, truth) in enumerate(truths.items()))

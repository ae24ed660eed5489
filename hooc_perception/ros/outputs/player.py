# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""When each recorded image is due, and with which stamp; independent of ROS."""

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, TypeAlias

from hooc_perception.core.config import Config, param

# (camera, recorded stamp in ns, message)
RecordedImage: TypeAlias = tuple[str, int, Any]


@dataclass(frozen=True)
class Due:
    """
    One image to publish.

    :ivar stamp_ns: the stamp to publish it with.
    """

    camera: str
    stamp_ns: int
    message: Any


@dataclass(frozen=True)
class PlayerConfig(Config):
    """Parameters of the playback."""

    rate: float = param(1.0, 'Speed relative to the recording; 0 = send each frame set when the '
                        'last one is answered on objects/poses, as fast as the chain processes '
                        'them.', '', 0.0, 100.0)
    loop: bool = param(False, 'Start again at the end, one mean frame period after the last image '
                       '(after one second if the bag holds a single frame set).')
    restamp: bool = param(True, 'Stamp the images with the current time and keep the recorded '
                          'intervals (divided by rate); false keeps the recorded stamps.')
    min_gap_s: float = param(0.005, 'Minimum time between two images: large messages that are '
                             'sent back to back may get lost.', 's', 0.0, 1.0)


class Player:
    """
    Pace recorded images like those of live cameras.

    :param images: returns a new iterator over the images, in the order of time.
    :ivar set_stamp_ns: stamp of the first image of the latest frame set (rate 0).
    :ivar published: number of images that were due so far.
    """

    def __init__(self, images: Callable[[], Iterator[RecordedImage]],
                 config: PlayerConfig = PlayerConfig()) -> None:
        """Start with the first image at the first call of `due`."""
        self._images, self.rate, self.restamp = images, config.rate, config.restamp
        self.loop, self._min_gap_ns = config.loop, round(config.min_gap_s * 1e9)
        self._iterator = iter(images())
        self._next = next(self._iterator, None)
        # Of this pass: node time and recorded stamp of the first image, images per camera.
        self._start: int | None = None
        self._first, self._sent = 0, Counter[str]()
        self._not_before = 0                        # node time
        self._last_time: int | None = None
        self._in_set: set[str] = set()              # cameras sent since the last release
        self._held = False
        self.set_stamp_ns = self.published = 0

    @property
    def finished(self) -> bool:
        """Return whether all images were due."""
        return self._next is None

    def due(self, now_ns: int) -> Due | None:
        """Return the image that is due at a node time, or None; call it often."""
        if self._next is None or self._held:
            return None
        if self._last_time is not None and now_ns - self._last_time < self._min_gap_ns:
            return None
        camera, stamp, message = self._next
        if self._start is None:
            if self.rate and now_ns < self._not_before:
                return None
            self._start, self._first = now_ns, stamp
        when = self._start + round((stamp - self._first) / (self.rate or 1.0))
        if self.rate and now_ns < when:
            return None
        if not self.rate:
            if camera in self._in_set:
                self._held = True
                return None
            # Intervals as recorded, from the first image of the set on.
            if not self._in_set:
                self._start, self._first, when = now_ns, stamp, now_ns
                self.set_stamp_ns = when if self.restamp else stamp
            self._in_set.add(camera)
        self._last_time, self.published = now_ns, self.published + 1
        self._sent[camera] += 1
        self._advance(stamp, when)
        return Due(camera, when if self.restamp else stamp, message)

    @property
    def waits_for_release(self) -> bool:
        """Return whether a complete set was sent and `released()` must be called (rate 0)."""
        return self._held

    def released(self) -> None:
        """Allow the next frame set (rate 0)."""
        self._held = False
        self._in_set.clear()

    def _advance(self, stamp: int, when: int) -> None:
        """Read the next image; `stamp` and `when` (recorded, node time) are of the last one."""
        self._next = next(self._iterator, None)
        if self._next is None and self.loop:
            self._iterator = iter(self._images())
            self._next = next(self._iterator)
            images = max(self._sent.values())
            period_ns = (stamp - self._first) / (images - 1) if images > 1 else 1e9
            self._not_before = when + round(period_ns / (self.rate or 1.0))
            self._start = None
            self._sent.clear()

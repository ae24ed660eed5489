# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""When each recorded image is due, and with which stamp: pure, so that it can be tested."""

from collections import Counter
from dataclasses import dataclass

from hooc_perception.core.config import Config, param


@dataclass(frozen=True)
class Due:
    """One image to publish: of which camera, its message, the stamp to give it."""

    camera: str
    stamp_ns: int
    message: object


@dataclass(frozen=True)
class PlayerConfig(Config):
    """How recorded images are paced."""

    rate: float = param(1.0, 'Speed: 1 as recorded; 0 sends a frame set when the last one is '
                        'answered on objects/poses, as fast as the chain takes them.', '', 0.0,
                        100.0)
    loop: bool = param(False, 'Start again at the end, one mean frame period after the last image '
                       '(a bag of one frame set: one second).')
    restamp: bool = param(True, 'Give the images stamps of now, with the recorded distances (by '
                          'rate); without, the recorded ones.')
    min_gap_s: float = param(0.005, 'Least time between two images: large messages sent back to '
                             'back are what gets lost.', 's', 0.0, 1.0)


class Player:
    """
    Pace recorded images like live cameras.

    :param images: callable that returns a fresh iterator of (camera, stamp_ns, message) in
        the order of time.
    """

    def __init__(self, images, config=PlayerConfig()):
        """Start with the first image at the first call of `due`."""
        self._images, self.rate, self.restamp = images, config.rate, config.restamp
        self.loop, self._min_gap_ns = config.loop, round(config.min_gap_s * 1e9)
        self._iterator, self._next = iter(images()), None
        # Of this pass: node time and recorded stamp of the first image, images a camera.
        self._start, self._first, self._sent = None, None, Counter()
        self._not_before = 0                # node time
        self._last_time = None
        self._in_set = set()                # cameras sent since the last release
        self.set_stamp_ns = 0               # given to the first image of the latest set
        self._held = False
        self.finished, self.published = False, 0
        self._advance()

    def due(self, now_ns):
        """Return the Due image, or None while there is none; call often."""
        if self.finished or self._held:
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
            # Distances as recorded from the set's first image on.
            if not self._in_set:
                self._start, self._first, when = now_ns, stamp, now_ns
                self.set_stamp_ns = when if self.restamp else stamp
            self._in_set.add(camera)
        self._last_time, self.published = now_ns, self.published + 1
        self._sent[camera] += 1
        self._advance(stamp, when)
        return Due(camera, when if self.restamp else stamp, message)

    @property
    def waits_for_release(self):
        """Return whether a whole set is out and `released()` is awaited (rate 0)."""
        return self._held

    def released(self):
        """Let the next frame set go (rate 0)."""
        self._held = False
        self._in_set.clear()

    def _advance(self, stamp=None, when=None):
        """Read the next image; `stamp` and `when` are those of the last one."""
        self._next = next(self._iterator, None)
        if self._next is None and self.loop and self.published:
            self._iterator = iter(self._images())
            self._next = next(self._iterator)
            images = max(self._sent.values())
            period_ns = (stamp - self._first) / (images - 1) if images > 1 else 1e9
            self._not_before = when + round(period_ns / (self.rate or 1.0))
            self._start = None
            self._sent.clear()
        self.finished = self._next is None

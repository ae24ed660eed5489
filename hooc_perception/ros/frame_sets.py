# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Assembly of N free-running cameras into frame sets, and the join of what stages publish.

Pure Python on integer nanoseconds, so that every order of arrival can be tested. Whatever is
dropped has a reason, which is counted.
"""

from collections import Counter, OrderedDict
from dataclasses import dataclass

from hooc_perception.core.config import Config, param

# Why a frame is lost that the user would rather have kept, in words.
EXPLAINED = {'stale': 'its stamp is too old by the clock of this node (wrong clock, or recorded '
                      'data without use_sim_time; max_frame_age_s 0 accepts any age)',
             'out_of_order': 'it is older than the one before',
             'duplicate': 'its stamp has been seen already',
             'time_jump': 'time was set back, so all that waited is forgotten',
             'spread': 'it is too far in time from the frames of the other cameras '
                       '(max_set_spread_s)'}


@dataclass(frozen=True)
class FrameSetConfig(Config):
    """When frames of several cameras belong together."""

    max_frame_age_s: float = param(
        1.0, 'A frame older than this by the clock of the node is dropped; 0 accepts any age '
        '(recorded stamps without use_sim_time).', 's', 0.0, 3600.0, runtime=True)
    max_set_spread_s: float = param(
        0.1, 'Frames of one set differ by no more than this: three cameras of 30 Hz that run '
        'freely are within 0.034 s.', 's', 0.0, 10.0, runtime=True)
    time_jump_s: float = param(
        1.0, 'A stamp that lies farther back than this behind the last one of its camera means '
        'that time was set back (a looped bag): what waits is forgotten.', 's', 0.01, 3600.0)


@dataclass(frozen=True)
class FrameSet:
    """One frame a camera, in camera order, and the stamp of the oldest: the join key."""

    stamp_ns: int
    frames: tuple


class FrameSets:
    """
    Keep the latest frame of each camera and give out sets of them, each frame once.

    :param cameras: names in order.
    :param config: FrameSetConfig; may be replaced while running.
    """

    def __init__(self, cameras, config):
        self.cameras, self.config = tuple(cameras), config
        self.drops = Counter()          # (camera, reason) -> number
        self._told = Counter()          # what new_drops has given out already
        self._latest = {}               # camera -> (stamp_ns, frame), unused
        self._last_stamp = {}           # camera -> stamp_ns, used or not

    def add(self, camera, stamp_ns, frame, now_ns):
        """
        Take in a frame; return None, or the reason why it (or the one it replaces) was dropped.

        Reasons: `unknown_camera`, `duplicate`, `out_of_order`, `stale`, `time_jump` (this frame
        is kept, all older ones are dropped), `superseded` (this frame is kept, an unused older
        one of the same camera is dropped).
        """
        if camera not in self.cameras:
            return self._drop(camera, 'unknown_camera')
        last = self._last_stamp.get(camera)
        if last is not None and stamp_ns <= last:
            if stamp_ns == last:
                return self._drop(camera, 'duplicate')
            if last - stamp_ns <= self.config.time_jump_s * 1e9:
                return self._drop(camera, 'out_of_order')
            self.clear()
            self._keep(camera, stamp_ns, frame)
            return self._drop(camera, 'time_jump')
        if self._too_old(stamp_ns, now_ns):
            self._last_stamp[camera] = stamp_ns
            return self._drop(camera, 'stale')
        reason = self._drop(camera, 'superseded') if camera in self._latest else None
        self._keep(camera, stamp_ns, frame)
        return reason

    def take(self, now_ns):
        """
        Return the FrameSet of one unused frame from every camera, or None while there is none.

        Frames that have grown too old or lie too far behind the newest are dropped (`stale`,
        `spread`): their cameras have to deliver again.
        """
        for camera in list(self._latest):
            if self._too_old(self._latest[camera][0], now_ns):
                self._drop(camera, 'stale')
                del self._latest[camera]
        if len(self._latest) < len(self.cameras):
            return None
        newest = max(stamp for stamp, _ in self._latest.values())
        late = [camera for camera, (stamp, _) in self._latest.items()
                if newest - stamp > self.config.max_set_spread_s * 1e9]
        for camera in late:
            self._drop(camera, 'spread')
            del self._latest[camera]
        if late:
            return None
        frames = tuple(self._latest[camera] for camera in self.cameras)
        self._latest.clear()
        return FrameSet(min(stamp for stamp, _ in frames), tuple(frame for _, frame in frames))

    def new_drops(self):
        """Return the Counter of drops since the last call."""
        new = self.drops - self._told
        self._told = self.drops.copy()
        return new

    def missing(self):
        """Return the cameras from which no unused frame is at hand."""
        return [camera for camera in self.cameras if camera not in self._latest]

    def clear(self):
        """Forget all frames and stamps, but not the counts."""
        self._latest.clear()
        self._last_stamp.clear()

    def _keep(self, camera, stamp_ns, frame):
        self._latest[camera] = (stamp_ns, frame)
        self._last_stamp[camera] = stamp_ns

    def _too_old(self, stamp_ns, now_ns):
        age = self.config.max_frame_age_s
        return age > 0 and now_ns - stamp_ns > age * 1e9

    def _drop(self, camera, reason):
        self.drops[camera, reason] += 1
        return reason


class StampJoin:
    """
    Bring together the parts that several topics carry for one stamp.

    :param parts: names of all parts of a whole.
    :param capacity: how many stamps may wait; the oldest makes room.
    """

    def __init__(self, parts, capacity=16):
        self.parts, self.capacity = frozenset(parts), capacity
        self.drops = Counter()          # (missing part, reason) -> number
        self._waiting = OrderedDict()   # stamp_ns -> {part: value}

    def add(self, part, stamp_ns, value):
        """
        Take in one part; return {part: value} once the stamp is whole, else None.

        When a stamp is whole, earlier arrivals that still wait can only be older news and are
        dropped as `incomplete`, under the name of a part that they lack; so is the first to
        arrive where more than `capacity` wait.
        """
        have = self._waiting.setdefault(stamp_ns, {})
        have[part] = value
        if self.parts <= have.keys():
            for stamp in list(self._waiting):
                if stamp == stamp_ns:
                    break
                self._drop(stamp)
            return self._waiting.pop(stamp_ns)
        while len(self._waiting) > self.capacity:
            self._drop(next(iter(self._waiting)))
        return None

    def clear(self):
        """Forget everything that waits."""
        self._waiting.clear()

    def _drop(self, stamp):
        have = self._waiting.pop(stamp)
        self.drops[min(self.parts - have.keys()), 'incomplete'] += 1

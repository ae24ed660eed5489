# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Assembly of N free-running cameras into frame sets.

Pure Python on integer nanoseconds, so that every order of arrival can be tested. Every dropped
frame has a reason, which is counted.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from hooc_perception.core.config import Config, param
from hooc_perception.io.set_back import SetBack

Frame = TypeVar('Frame')

# Why a frame was dropped that the user would rather have kept, in words.
EXPLAINED = {'stale': 'its stamp is too old by the clock of this node (wrong clock, or simulated '
                      'or recorded data without use_sim_time; max_frame_age_s 0 accepts any age)',
             'future': 'its stamp lies in the future by the clock of this node; synchronise the '
                       'clocks of the computers (max_frame_age_s 0 accepts any stamp)',
             'no_stamp': 'its stamp is zero; let the driver stamp its images',
             'out_of_order': 'it is older than the one before',
             'duplicate': 'its stamp has been seen already',
             'time_jump': 'time was set back, so all waiting frames are dropped',
             'spread': 'it is too far in time from the frames of the other cameras; '
                       'max_set_spread_s must be at least the frame period of cameras that are '
                       'not triggered together'}
SILENT, APART = 'silent', 'apart'


@dataclass(frozen=True)
class FrameSetConfig(Config):
    """When frames of several cameras belong together."""

    max_frame_age_s: float = param(
        1.0, 'A frame that is older than this by the clock of the node, or as far ahead of it, is '
        'dropped; 0 accepts any stamp (recordings without use_sim_time).', 's',
        0.0, 3600.0, runtime=True)
    max_set_spread_s: float = param(
        0.1, 'Largest difference between the stamps of one frame set; three free-running cameras '
        'of 30 Hz are within 0.034 s.', 's', 0.0, 10.0, runtime=True)
    time_jump_s: float = param(
        1.0, 'A stamp that lies farther than this behind the last one of its camera means that '
        'time was set back (a looped bag): all waiting frames are dropped. So do old stamps from '
        'all cameras, or several in a row from one.', 's', 0.01, 3600.0)
    camera_timeout_s: float = param(
        2.0, 'Frame sets leave out a camera that has been silent for this time while others were '
        'not, until it returns; must exceed the frame period of the slowest camera. 0 = always '
        'wait for every camera.', 's', 0.0, 3600.0, runtime=True)
    min_cameras: int = param(1, 'No frame set is sent with fewer cameras than this.', '', 1, 64,
                             runtime=True)


@dataclass(frozen=True)
class FrameSet(Generic[Frame]):
    """
    At most one frame per camera, in camera order, and the stamp of the oldest: the join key.

    :ivar frames: None for cameras that have dropped out.
    """

    stamp_ns: int
    frames: tuple[Frame | None, ...]


class FrameSets(Generic[Frame]):
    """
    Keep the latest frame of each camera and combine them to sets, each frame used once.

    A camera is lost once the others have waited `camera_timeout_s` for it: because it is silent,
    or because its stamps are too far from those of most cameras. It is waited for again as soon
    as it delivers a frame that fits.

    :ivar config: FrameSetConfig; may be replaced while running.
    :ivar drops: how often a (camera, reason) lost a frame.
    :ivar used: how many frames of each camera went out in sets.
    :ivar lost: {camera: SILENT or APART}.
    """

    def __init__(self, cameras: Sequence[str], config: FrameSetConfig) -> None:
        """Begin without any frame; `cameras` are names in order."""
        self.cameras, self.config = tuple(cameras), config
        self.drops: Counter[tuple[str, str]] = Counter()
        self.used: Counter[str] = Counter()
        self.lost: dict[str, str] = {}
        self._told: Counter[tuple[str, str]] = Counter()    # what new_drops has returned already
        self._latest: dict[str, tuple[int, Frame]] = {}     # (stamp in ns, frame), unused
        self._last_stamp: dict[str, int] = {}               # in ns, used or not
        # Node time in ns, per camera: since which the others wait for it; of the arrival of its
        # last frame that was kept; of that arrival minus the stamp of the frame.
        self._missed: dict[str, int] = {}
        self._arrival: dict[str, int] = {}
        self._lag: dict[str, int] = {}
        self._now: int | None = None                        # node time of the last call
        self._set_back: SetBack[Frame] = SetBack()

    def add(self, camera: str, stamp_ns: int, frame: Frame, now_ns: int) -> str | None:
        """
        Take in a frame; return None, or the reason why it (or the one it replaces) was dropped.

        Reasons: `unknown_camera`, `no_stamp`, `future`, `duplicate`, `out_of_order`, `stale`,
        `time_jump` (this frame is kept, all older ones are dropped), `superseded` (this frame
        is kept, an unused older one of the same camera is dropped).
        """
        self._watch_clock(now_ns)
        if camera not in self.cameras:
            return self._drop(camera, 'unknown_camera')
        if stamp_ns == 0:
            return self._drop(camera, 'no_stamp')
        age = self.config.max_frame_age_s
        if age > 0 and stamp_ns - now_ns > age * 1e9:
            return self._drop(camera, 'future')
        last = self._last_stamp.get(camera)
        if last is not None and stamp_ns <= last:
            reason = 'duplicate' if stamp_ns == last else 'out_of_order'
            if last - stamp_ns <= self.config.time_jump_s * 1e9 and (
                    self._too_old(stamp_ns, now_ns) or not self._set_back.shown_by(
                        camera, stamp_ns, frame, reason, self._wanted(),
                        now_ns - self._arrival.get(camera, now_ns))):
                return self._drop(camera, reason)
            return self._jump(camera, stamp_ns, frame, now_ns)
        self._set_back.newer(camera)
        if self._too_old(stamp_ns, now_ns):
            self._last_stamp[camera] = stamp_ns
            return self._drop(camera, 'stale')
        reason = self._drop(camera, 'superseded') if camera in self._latest else None
        self._keep(camera, stamp_ns, frame, now_ns)
        return reason

    def take(self, now_ns: int) -> FrameSet[Frame] | None:
        """
        Return the FrameSet of one unused frame from every camera, or None while there is none.

        Frames that have become too old or lie too far from the newest are dropped (`expired`,
        `spread`): their cameras have to deliver again. Lost cameras are not waited for.
        """
        self._watch_clock(now_ns)
        for camera in list(self._latest):
            if self._too_old(self._latest[camera][0], now_ns):
                self._drop(camera, 'expired')
                del self._latest[camera]
        if not self._latest:
            return None
        for camera in self.missing():
            self._missed.setdefault(camera, now_ns)
        self._give_up(now_ns)
        wanted = self._wanted()
        if not wanted or any(camera not in self._latest for camera in wanted):
            return None
        newest = max(self._latest[camera][0] for camera in wanted)
        apart = [camera for camera, (stamp, _) in self._latest.items()
                 if abs(newest - stamp) > self.config.max_set_spread_s * 1e9]
        for camera in apart:
            self._drop(camera, 'spread')
            self._missed.setdefault(camera, now_ns)
            del self._latest[camera]
        if not set(apart).isdisjoint(wanted) or len(self._latest) < self.config.min_cameras:
            return None
        frames = tuple(self._latest.get(camera) for camera in self.cameras)
        for camera in self._latest:
            self._missed.pop(camera, None)
            self.lost.pop(camera, None)
        self.used.update(self._latest.keys())
        self._latest.clear()
        return FrameSet(min(frame[0] for frame in frames if frame),
                        tuple(frame and frame[1] for frame in frames))

    def new_drops(self) -> Counter[tuple[str, str]]:
        """Return the Counter of drops since the last call."""
        new = self.drops - self._told
        self._told = self.drops.copy()
        return new

    def missing(self) -> list[str]:
        """Return the cameras without an unused frame."""
        return [camera for camera in self.cameras if camera not in self._latest]

    def clear(self) -> None:
        """Forget all frames and stamps, but neither the counts nor which cameras are lost."""
        self._begin_anew()
        self._missed.clear()

    def _begin_anew(self) -> None:
        self._latest.clear()
        self._last_stamp.clear()
        self._set_back.clear()

    def _wanted(self) -> list[str]:
        """Return the cameras that are not lost."""
        return [camera for camera in self.cameras if camera not in self.lost]

    def _jump(self, camera: str, stamp_ns: int, frame: Frame, now_ns: int) -> str:
        """Begin anew with a frame, and those of other cameras that had seemed to be old."""
        for other in self._latest:
            if other != camera:
                self._drop(other, 'time_jump')
        fitting = self._set_back.fitting(camera, stamp_ns, self.config.max_set_spread_s * 1e9)
        self._begin_anew()
        for other, stray in fitting.items():
            key = other, stray.reason
            self.drops[key] -= 1        # it is used after all
            self._told[key] = min(self._told[key], self.drops[key])
            self._keep(other, stray.stamp_ns, stray.frame, now_ns)
        self._keep(camera, stamp_ns, frame, now_ns)
        return self._drop(camera, 'time_jump')

    def _keep(self, camera: str, stamp_ns: int, frame: Frame, now_ns: int) -> None:
        spread_ns = self.config.max_set_spread_s * 1e9
        lag = self._lag[camera] = now_ns - stamp_ns
        if self.lost.get(camera) == SILENT or self.lost.get(camera) == APART and any(
                abs(lag - self._lag[other]) <= spread_ns for other in self._lag
                if other not in self.lost):
            # From now on the others wait for it again.
            del self.lost[camera]
            self._missed.pop(camera, None)
        last = max(self._arrival.values(), default=now_ns)
        if now_ns - last > self.config.camera_timeout_s * 1e9:
            # No camera was heard, so none was missed in particular.
            self._missed = {c: t for c, t in self._missed.items() if c in self.lost}
        self._arrival[camera] = now_ns
        self._latest[camera] = (stamp_ns, frame)
        self._last_stamp[camera] = stamp_ns

    def _give_up(self, now_ns: int) -> None:
        """Declare those cameras lost that have been missed for too long."""
        timeout_ns = self.config.camera_timeout_s * 1e9
        if not timeout_ns:
            self.lost.clear()
            return
        overdue = [camera for camera, since in self._missed.items()
                   if camera not in self.lost and now_ns - since > timeout_ns]
        silent = [camera for camera in overdue
                  if self._arrival.get(camera, -1) < self._missed[camera]]
        self.lost.update(dict.fromkeys(silent, SILENT))
        if len(silent) == len(overdue):
            return
        # They deliver, but too far apart: the largest group of agreeing clocks goes on.
        there = [camera for camera in self.cameras
                 if camera in self._lag and self.lost.get(camera) != SILENT]
        spread_ns = self.config.max_set_spread_s * 1e9
        groups = [[other for other in there
                   if 0 <= self._lag[other] - self._lag[camera] <= spread_ns] for camera in there]
        group = max(groups, key=len)
        for camera in there:
            self._missed.pop(camera, None)
            if camera in group:
                self.lost.pop(camera, None)
            else:
                self.lost[camera] = APART

    def _watch_clock(self, now_ns: int) -> None:
        """Begin to wait again if the clock of the node was set back."""
        if self._now is not None and now_ns < self._now:
            self._missed.clear()
            self._arrival = dict.fromkeys(self._arrival, now_ns)
            self._set_back.clock_went_back(self.cameras)
        self._now = now_ns

    def _too_old(self, stamp_ns: int, now_ns: int) -> bool:
        age = self.config.max_frame_age_s
        return age > 0 and now_ns - stamp_ns > age * 1e9

    def _drop(self, camera: str, reason: str) -> str:
        self.drops[camera, reason] += 1
        return reason

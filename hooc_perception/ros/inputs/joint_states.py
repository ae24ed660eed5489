# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Where the joints of a robot were at the stamp of an image."""

from bisect import bisect
from collections import deque
from collections.abc import Iterable
import math

from hooc_perception.errors import HoocError
from hooc_perception.ros.messages.conversions import nanoseconds
from sensor_msgs.msg import JointState

# Positions of each joint that are kept: half a second of a 1 kHz controller.
CAPACITY = 512
# A stamp that lies farther than this behind the last one means that time was set back.
SET_BACK_NS = 10**9


class StateNotYet(HoocError):
    """The state at a stamp is still to come."""


class StateUnknown(HoocError):
    """Nobody has told the state at a stamp; `code` is the reason in short."""

    def __init__(self, code: str, sentence: str) -> None:
        """Keep the code beside the sentence."""
        super().__init__(sentence)
        self.code = code


class JointStates:
    """
    The latest positions of joints, which may come in parts from several publishers.

    :ivar names: of all joints that were heard of.
    """

    def __init__(self) -> None:
        """Begin without any."""
        self._history: dict[str, deque[tuple[int, float]]] = {}

    @property
    def names(self) -> frozenset[str]:
        """Return the names of all joints that were heard of."""
        return frozenset(self._history)

    def forget(self) -> None:
        """Forget everything."""
        self._history.clear()

    def add(self, message: JointState, now_ns: int) -> None:
        """
        Take in a JointState; joints without a finite position in it are skipped.

        :param now_ns: the stamp of a message that has none.
        """
        stamp = nanoseconds(message.header.stamp) or now_ns
        for name, position in zip(message.name, message.position):
            if not math.isfinite(position):
                continue
            history = self._history.setdefault(name, deque(maxlen=CAPACITY))
            if history and stamp < history[-1][0] - SET_BACK_NS:
                history.clear()
            # Of two publishers of one joint, the later one counts.
            if not history or stamp > history[-1][0]:
                history.append((stamp, position))

    def at(self, stamp_ns: int, joints: Iterable[str], within_ns: int,
           final: bool = False) -> dict[str, float]:
        """
        Return {joint: position} at a stamp, interpolated between the states around it.

        :param within_ns: the nearest state may be this far away.
        :param final: take the last state where none after the stamp has come.
        :raises StateNotYet: if a state after the stamp is still to come.
        :raises StateUnknown: if a joint was never heard of, or not near that stamp.
        """
        positions = {}
        missing = [name for name in joints if name not in self._history]
        if missing:
            raise StateUnknown('no_joint_state', 'nobody has published the position of '
                               f'{", ".join(missing)} on joint_states')
        for name in joints:
            history = self._history[name]
            k = bisect(history, stamp_ns, key=lambda sample: sample[0])
            if k == len(history) and history[-1][0] != stamp_ns and not final:
                raise StateNotYet(f'the position of {name} at that stamp is still to come')
            before, after = history[max(k - 1, 0)], history[min(k, len(history) - 1)]
            nearest = min(abs(stamp_ns - before[0]), abs(stamp_ns - after[0]))
            if nearest > within_ns:
                raise StateUnknown('old_joint_state', (
                    f'the nearest position of {name} is {nearest * 1e-9:.3g} s away from the '
                    'stamp of the image (robot_state_age_s); synchronise the clocks, or publish '
                    'joint_states more often'))
            share = 0.0 if after[0] == before[0] else min(
                1.0, max(0.0, (stamp_ns - before[0]) / (after[0] - before[0])))
            positions[name] = before[1] + share * (after[1] - before[1])
        return positions

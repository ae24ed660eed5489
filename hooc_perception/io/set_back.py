# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Late frames told apart from time that was set back by a little, as by a short looped bag."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

Frame = TypeVar('Frame')

# This many old frames of a camera in a row, without a newer one between, are no strays.
STRAYS = 3
# The same frame again within this time was sent twice; a loop takes longer.
TWICE_NS = 50_000_000


@dataclass
class Stray(Generic[Frame]):
    """An old frame that may turn out to be new; `number` of them in a row."""

    stamp_ns: int
    frame: Frame
    reason: str
    number: int


class SetBack(Generic[Frame]):
    """
    Remember the old frames of each camera since its last newer one.

    Time was set back if all cameras that are waited for deliver old frames (or the same ones
    again) one after the other, if one delivers several in a row, or if any does so after the
    node's clock went back. The same frame again and again from one camera of several is a
    driver that hangs.
    """

    def __init__(self) -> None:
        """Begin without any."""
        self._strays: dict[str, Stray[Frame]] = {}      # the last one of each camera
        # Cameras with old frames since the last newer one of any camera, and cameras without a
        # newer frame since the clock went back.
        self._together: set[str] = set()
        self._rewound: set[str] = set()

    def clock_went_back(self, cameras: Iterable[str]) -> None:
        """Note that the node's clock was set back: any old frame is a new one."""
        self._rewound = set(cameras)

    def newer(self, camera: str) -> None:
        """Note that a camera has delivered a newer frame: what was older before had strayed."""
        self._strays.pop(camera, None)
        self._together.clear()
        self._rewound.discard(camera)

    def clear(self) -> None:
        """Forget everything."""
        self._strays.clear()
        self._together.clear()
        self._rewound.clear()

    def shown_by(self, camera: str, stamp_ns: int, frame: Frame, reason: str,
                 wanted: Sequence[str], pause_ns: int) -> bool:
        """
        Return whether an old frame shows that time was set back.

        :param reason: `duplicate` or `out_of_order`, if it has strayed.
        :param wanted: the cameras that are waited for.
        :param pause_ns: node time since the last newer frame of the camera.
        """
        if reason == 'duplicate' and pause_ns < TWICE_NS and camera not in self._rewound:
            return False
        before = self._strays.get(camera)
        counts = reason != 'duplicate' or wanted == [camera]
        number = (before.number if before else 0) + counts
        self._strays[camera] = Stray(stamp_ns, frame, reason, number)
        self._together.add(camera)
        return (camera in self._rewound or number >= STRAYS
                or len(wanted) > 1 and self._together >= set(wanted))

    def fitting(self, camera: str, stamp_ns: int, spread_ns: float) -> dict[str, Stray[Frame]]:
        """Return {other camera: Stray} of those near a stamp: they belong to the new time."""
        return {other: stray for other, stray in self._strays.items()
                if other != camera and abs(stray.stamp_ns - stamp_ns) <= spread_ns}

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Old frames that have strayed told from time that was set back by little: a short bag looped."""

from dataclasses import dataclass

# So many old frames of a camera in a row, without a newer one between, are no strays.
STRAYS = 3
# The same frame again within this time was sent twice; a loop takes longer.
TWICE_NS = 50_000_000


@dataclass
class Stray:
    """An old frame that may turn out to be new; `number` of them in a row."""

    stamp_ns: int
    frame: object
    reason: str
    number: int


class SetBack:
    """
    Remember the old frames of each camera since its last newer one.

    Time was set back where all cameras that are waited for deliver old frames (or the same ones
    again) one after the other, where one delivers several in a row, or any after the node's clock
    went back. The same frame again and again from one camera of several is a driver that hangs.
    """

    def __init__(self):
        """Begin without any."""
        self._strays = {}           # camera -> the last Stray
        self._together = set()      # cameras with old frames since the last newer one of any
        self._rewound = set()       # cameras without a newer frame since the clock went back

    def clock_went_back(self, cameras):
        """Note that the node's clock was set back: any old frame is a new one."""
        self._rewound = set(cameras)

    def newer(self, camera):
        """Note that a camera has delivered a newer frame: what was older before had strayed."""
        self._strays.pop(camera, None)
        self._together.clear()
        self._rewound.discard(camera)

    def clear(self):
        """Forget everything."""
        self._strays.clear()
        self._together.clear()
        self._rewound.clear()

    def shown_by(self, camera, stamp_ns, frame, reason, wanted, pause_ns):
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

    def fitting(self, camera, stamp_ns, spread_ns):
        """Return {other camera: Stray} of those near a stamp: they belong to the new time."""
        return {other: stray for other, stray in self._strays.items()
                if other != camera and abs(stray.stamp_ns - stamp_ns) <= spread_ns}

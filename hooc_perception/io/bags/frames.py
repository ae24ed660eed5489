# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Static transforms as a tree of frames."""

from typing import Any

from hooc_perception.core.arrays import Float64Array
from hooc_perception.core.geometry import matrix_from_pose
from hooc_perception.errors import HoocError
import numpy as np


class FrameTree:
    """The transforms of /tf_static and extrinsics topics, by child frame."""

    def __init__(self) -> None:
        """Start without any transform."""
        self._parents: dict[str, tuple[str, Float64Array]] = {}

    def add(self, stamped: Any, where: str) -> None:
        """
        Add a TransformStamped message; it replaces an earlier one of the same child.

        :param where: names bag and topic in the error.
        :raises HoocError: if the rotation is not a unit quaternion.
        """
        t, q = stamped.transform.translation, stamped.transform.rotation
        translation, rotation = np.array([t.x, t.y, t.z]), np.array([q.x, q.y, q.z, q.w])
        child = plain(stamped.child_frame_id)
        if not np.isfinite(translation).all() or not abs(np.linalg.norm(rotation) - 1) < 1e-3:
            raise HoocError(f'{where}: the transform of {child} is not finite or its rotation is '
                            'not a unit quaternion; correct the publisher')
        self._parents[child] = (plain(stamped.header.frame_id),
                                matrix_from_pose(translation, rotation))

    def root(self, frame: str) -> str:
        """Return the topmost frame above `frame`: itself if it has no parent."""
        return self.chain(frame)[-1][0]

    def chain(self, frame: str) -> list[tuple[str, Float64Array]]:
        """Return [(frame, I), (parent, T_parent_frame), ...] up to the root."""
        steps, T = [(plain(frame), np.eye(4))], np.eye(4)
        while steps[-1][0] in self._parents:
            parent, T_parent_child = self._parents[steps[-1][0]]
            if any(parent == seen for seen, _ in steps):
                break
            T = T_parent_child @ T
            steps.append((parent, T))
        return steps

    def transform(self, target: str, frame: str) -> Float64Array | None:
        """Return T_target_frame (4, 4), None if `target` is not connected with `frame`."""
        down = dict(self.chain(target))
        for ancestor, T_ancestor_frame in self.chain(frame):
            if ancestor in down:
                return np.linalg.inv(down[ancestor]) @ T_ancestor_frame
        return None

    def __contains__(self, frame: str) -> bool:
        """Return whether any transform names this frame."""
        return frame in self._parents or any(frame == p for p, _ in self._parents.values())


def plain(frame_id: str) -> str:
    """Return a frame's name without the leading slash of ROS 1 drivers."""
    return frame_id.lstrip('/')

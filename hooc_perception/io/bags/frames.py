# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Static transforms as a tree of frames."""

from collections.abc import Iterable
from typing import Any

from hooc_perception.core.arrays import Float64Array
from hooc_perception.core.geometry import matrix_from_pose
from hooc_perception.errors import HoocError
import numpy as np

# A frame that moves less than this on /tf is static: joints at rest are noisy.
STILL_M, STILL_RAD = 0.001, np.radians(0.1)


class FrameTree:
    """
    The transforms of /tf_static and extrinsics topics, by child frame.

    :ivar moving: {child frame: parent frame} of what /tf moves, which is not part of the tree.
    """

    def __init__(self) -> None:
        """Start without any transform."""
        self._parents: dict[str, tuple[str, Float64Array]] = {}
        self.moving: dict[str, str] = {}

    def add(self, stamped: Any, where: str) -> None:
        """
        Add a TransformStamped message; it replaces an earlier one of the same child.

        :param where: names bag and topic in the error.
        :raises HoocError: if the rotation is not a unit quaternion.
        """
        child, parent, T_parent_child = _transform(stamped, where)
        self._parents[child] = parent, T_parent_child

    def add_unmoved(self, recorded: Iterable[Any], where: str) -> None:
        """
        Add those frames of /tf that did not move while it was recorded.

        :param recorded: TransformStamped messages of a whole recording, in the order of time.
        :param where: names bag and topic in the error.
        """
        first: dict[str, tuple[str, Float64Array]] = {}
        for stamped in recorded:
            child, parent, T_parent_child = _transform(stamped, where)
            if child in self._parents or child in self.moving:
                continue
            known_parent, T_known = first.setdefault(child, (parent, T_parent_child))
            T_moved = np.linalg.inv(T_known) @ T_parent_child
            if known_parent != parent or np.linalg.norm(T_moved[:3, 3]) > STILL_M or (
                    np.trace(T_moved[:3, :3]) < 1 + 2 * np.cos(STILL_RAD)):
                self.moving[child] = parent
        self._parents.update({child: pose for child, pose in first.items()
                              if child not in self.moving})

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

    def __len__(self) -> int:
        """Return the number of transforms."""
        return len(self._parents)

    def __contains__(self, frame: str) -> bool:
        """Return whether any transform names this frame."""
        return frame in self._parents or any(frame == p for p, _ in self._parents.values())


def _transform(stamped: Any, where: str) -> tuple[str, str, Float64Array]:
    """Return (child, parent, T_parent_child) of a message; HoocError if it is no transform."""
    t, q = stamped.transform.translation, stamped.transform.rotation
    translation, rotation = np.array([t.x, t.y, t.z]), np.array([q.x, q.y, q.z, q.w])
    child = plain(stamped.child_frame_id)
    if not np.isfinite(translation).all() or not abs(np.linalg.norm(rotation) - 1) < 1e-3:
        raise HoocError(f'{where}: the transform of {child} is not finite or its rotation is '
                        'not a unit quaternion; correct the publisher')
    return child, plain(stamped.header.frame_id), matrix_from_pose(translation, rotation)


def plain(frame_id: str) -> str:
    """Return a frame's name without the leading slash of ROS 1 drivers."""
    return frame_id.lstrip('/')

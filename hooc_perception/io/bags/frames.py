# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Static transforms as a tree of frames."""

from hooc_perception.core.geometry import matrix_from_pose
from hooc_perception.errors import HoocError
import numpy as np


class FrameTree:
    """The transforms of /tf_static and extrinsics topics, by child frame."""

    def __init__(self):
        """Start without any transform."""
        self._parents = {}

    def add(self, stamped, where):
        """
        Add a TransformStamped; the latest one of a child counts.

        :param where: names bag and topic in the error.
        :raises HoocError: where the rotation is no unit quaternion.
        """
        t, q = stamped.transform.translation, stamped.transform.rotation
        translation, rotation = np.array([t.x, t.y, t.z]), np.array([q.x, q.y, q.z, q.w])
        child = plain(stamped.child_frame_id)
        if not np.isfinite(translation).all() or not abs(np.linalg.norm(rotation) - 1) < 1e-3:
            raise HoocError(f'{where}: the transform of {child} is not finite or its rotation no '
                            'unit quaternion; correct the publisher')
        self._parents[child] = (plain(stamped.header.frame_id),
                                matrix_from_pose(translation, rotation))

    def root(self, frame):
        """Return the topmost frame above `frame`: itself where nothing is known of it."""
        return self.chain(frame)[-1][0]

    def chain(self, frame):
        """Return [(frame, I), (parent, T_parent_frame), ...] up to the root."""
        steps, T = [(plain(frame), np.eye(4))], np.eye(4)
        while steps[-1][0] in self._parents:
            parent, T_parent_child = self._parents[steps[-1][0]]
            if any(parent == seen for seen, _ in steps):
                break
            T = T_parent_child @ T
            steps.append((parent, T))
        return steps

    def transform(self, target, frame):
        """Return T_target_frame (4, 4), None where `target` is not connected with `frame`."""
        down = dict(self.chain(target))
        for ancestor, T_ancestor_frame in self.chain(frame):
            if ancestor in down:
                return np.linalg.inv(down[ancestor]) @ T_ancestor_frame
        return None

    def __contains__(self, frame):
        """Say whether any transform names this frame."""
        return frame in self._parents or any(frame == p for p, _ in self._parents.values())


def plain(frame_id):
    """Return a frame's name without the leading slash that ROS 1 drivers left behind."""
    return frame_id.lstrip('/')

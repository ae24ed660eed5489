# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""MoveIt: the objects as collision objects of the planning scene, as long as they are there."""

from geometry_msgs.msg import Point, Pose
from hooc_perception.ros.messages.conversions import header, pose_message
from hooc_perception.ros.outputs.adapters.guard import messages_of
import numpy as np
from shape_msgs.msg import Mesh, MeshTriangle, SolidPrimitive

CHECK_S = 0.5


class PlanningSceneDiffs:
    """
    Publish diffs on /planning_scene: ADD for what is there, REMOVE for what is gone.

    What an answer does not show may only be hidden, perhaps by the robot: it stays for
    `planning_scene_ttl_s`. Where no answers come at all, everything goes after that time.

    :param shape: 'mesh' or 'box'.
    """

    def __init__(self, node, shape):
        """Create the publisher on a StageNode; HoocError without moveit_msgs."""
        self._node, self._shape = node, shape
        self._messages = messages_of('moveit_msgs', 'planning_scene')
        self._publisher = node.publisher(self._messages.PlanningScene, '/planning_scene')
        self._seen = {}     # name -> node time (ns) of the last answer that shows it
        self._frame, self._stamp_ns = node.config.target_frame, 0   # of the last answer
        node.owned(node.destroy_timer, node.create_timer(CHECK_S, node.guarded(
            self.expire, type(self).__name__, 'what is gone stays in the planning scene')))

    def publish(self, scene):
        """Add or replace the objects of a DetectedScene and remove those whose time is over."""
        now, self._frame = self._node.now_ns(), scene.frame
        shown = {o.name: now for o in scene.objects}
        # Time was set back (a looped bag): ids begin anew, and those of before never come again.
        gone = [] if scene.stamp_ns >= self._stamp_ns else sorted(set(self._seen) - set(shown))
        self._seen = {name: t for name, t in self._seen.items() if name not in gone} | shown
        self._stamp_ns = scene.stamp_ns
        added = [collision_object(o, scene.header, self._shape, self._messages)
                 for o in scene.objects]
        self._send(added, gone + self._expired(now), scene.header)

    def expire(self):
        """Remove what no answer has shown for too long."""
        if self._node.active:
            now = self._node.now_ns()
            self._send([], self._expired(now), header(now, self._frame))

    def clear(self, stamp_ns, frame):
        """Remove all that was added."""
        names, self._seen = list(self._seen), {}
        self._send([], names, header(stamp_ns, frame))

    def _expired(self, now):
        """Return and forget the names of the objects whose time is over."""
        ttl_ns = self._node.config.planning_scene_ttl_s * 1e9
        # A clock that was set back would keep everything for ever: that is over, too.
        names = [name for name, seen in self._seen.items() if not 0 <= now - seen <= ttl_ns]
        for name in names:
            del self._seen[name]
        return names

    def _send(self, added, removed, head):
        if added or removed:
            self._publisher.publish(diff_message(added, removed, head, self._messages))


def diff_message(added, removed, head, messages):
    """
    Return the PlanningScene diff that adds CollisionObjects and removes others.

    :param removed: names.
    """
    kind = messages.CollisionObject
    scene = messages.PlanningScene(is_diff=True)
    # Without this, MoveIt would take the empty robot state for the robot's.
    scene.robot_state.is_diff = True
    scene.world.collision_objects = [
        kind(header=head, id=name, operation=kind.REMOVE) for name in removed] + added
    return scene


def collision_object(found, head, shape, messages):
    """
    Return the CollisionObject of a DetectedObject; its id is the object's name, as teacup_7.

    :param shape: 'mesh': the scaled generic model; 'box': its bounding box.
    """
    kind = messages.CollisionObject
    out = kind(header=head, id=found.name, operation=kind.ADD,
               pose=pose_message(found.translation, found.rotation_xyzw))
    out.type.key = found.category
    here = Pose()
    here.orientation.w = 1.0
    if shape == 'box':
        out.primitives = [SolidPrimitive(type=SolidPrimitive.BOX,
                                         dimensions=found.size.tolist())]
        out.primitive_poses = [here]
    else:
        scale = found.size / np.maximum(found.model.extents, 1e-9)
        out.meshes = [Mesh(
            vertices=[Point(x=x, y=y, z=z)
                      for x, y, z in (found.model.vertices * scale).tolist()],
            triangles=[MeshTriangle(vertex_indices=face)
                       for face in found.model.faces.astype(np.uint32)])]
        out.mesh_poses = [here]
    return out

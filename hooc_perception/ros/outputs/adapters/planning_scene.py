# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The objects as collision objects in the planning scene of MoveIt."""

from collections.abc import Mapping, Sequence
from typing import Any

from geometry_msgs.msg import Point, PolygonStamped, Pose
from hooc_perception.core.arrays import AnyArray, Float64Array
from hooc_perception.ros.lifecycle.stage_node import StageNode
from hooc_perception.ros.messages.conversions import header, pose_message
from hooc_perception.ros.outputs.adapters.guard import messages_of
from hooc_perception.ros.outputs.detected import (
    DetectedObject,
    DetectedScene,
    DetectedUnknown,
    UNKNOWN,
)
import numpy as np
from scipy.spatial import ConvexHull
from shape_msgs.msg import Mesh, MeshTriangle, SolidPrimitive
from std_msgs.msg import ColorRGBA, Header

CHECK_S = 0.5
Color = tuple[float, float, float, float]      # red, green, blue, opacity
# Objects that the robot hides; and the colour that MoveIt itself gives to objects.
HIDDEN: Color = (0.5, 0.5, 0.5, 0.4)
SEEN: Color = (0.0, 0.8, 0.0, 1.0)
# The slab of the table lies so far below the surface, and is so thick: an object that stands on
# the table, once attached to a gripper, should not count as a collision.
TABLE_GAP_M, TABLE_THICKNESS_M = 0.005, 0.03


class PlanningSceneDiffs:
    """
    Publish diffs on /planning_scene: ADD for detected objects, REMOVE for those that are gone.

    An object that is missing from a result may be hidden: it stays for `planning_scene_ttl_s`.
    Objects that the robot is known to hide are in the results and stay, in the colour HIDDEN.
    Without any results, all objects are removed after that time.

    The table is added as it comes on scene/table and stays: a robot must not hit it whether or
    not objects are known.

    :param shape: 'mesh' or 'box'.
    :param table: whether to add the table.
    """

    def __init__(self, node: StageNode, shape: str, table: bool) -> None:
        """Create the publisher; HoocError without moveit_msgs."""
        self._node, self._shape = node, shape
        self._messages = messages_of('moveit_msgs', 'planning_scene')
        self._publisher = node.publisher(self._messages.PlanningScene, '/planning_scene')
        # Name -> node time (ns) of the last result with the object.
        self._seen: dict[str, int] = {}
        self._frame, self._stamp_ns = '', 0     # of the last result
        self._hidden: set[str] = set()          # names of those that are shown as hidden
        if table:
            node.subscription(PolygonStamped, 'scene/table', self._on_table)
        node.owned(node.destroy_timer, node.create_timer(CHECK_S, node.guarded(
            self.expire, type(self).__name__, 'objects that are gone stay in the planning scene')))

    def publish(self, scene: DetectedScene) -> None:
        """Add or replace the objects of a result and remove those that have expired."""
        now, self._frame = self._node.now_ns(), scene.frame
        shown = {o.name: now for o in (*scene.objects, *scene.unknown)}
        # Time was set back (a looped bag): ids start over, and the earlier ones never return.
        gone = [] if scene.stamp_ns >= self._stamp_ns else sorted(set(self._seen) - set(shown))
        self._seen = {name: t for name, t in self._seen.items() if name not in gone} | shown
        self._stamp_ns = scene.stamp_ns
        added = [collision_object(o, scene.header, self._shape, self._messages)
                 for o in scene.objects]
        added += [unknown_object(u, scene.header, self._shape, self._messages)
                  for u in scene.unknown]
        hidden = {o.name for o in scene.objects if o.hidden_s > 0}
        colors = dict.fromkeys((self._hidden - hidden) & shown.keys(), SEEN) | dict.fromkeys(
            hidden, HIDDEN)
        self._hidden = hidden
        self._send(added, gone + self._expired(now), scene.header, colors)

    def _on_table(self, outline: PolygonStamped) -> None:
        """Add the table, or replace it where it was."""
        slab = table_object(outline, self._messages)
        if slab is not None:
            self._send([slab], [], outline.header)

    def expire(self) -> None:
        """Remove the objects that have expired."""
        if self._node.active:
            now = self._node.now_ns()
            self._send([], self._expired(now), header(now, self._frame))

    def clear(self, stamp_ns: int, frame: str) -> None:
        """Remove all objects."""
        names, self._seen = list(self._seen), {}
        self._send([], names, header(stamp_ns, frame))

    def _expired(self, now: int) -> list[str]:
        """Return and forget the names of the objects that have been missing for too long."""
        ttl_ns = self._node.config.planning_scene_ttl_s * 1e9
        # After a clock was set back, ages are negative: these have expired, too.
        names = [name for name, seen in self._seen.items() if not 0 <= now - seen <= ttl_ns]
        for name in names:
            del self._seen[name]
        return names

    def _send(self, added: Sequence[Any], removed: Sequence[str], head: Header,
              colors: Mapping[str, Color] | None = None) -> None:
        if added or removed:
            self._publisher.publish(diff_message(added, removed, head, self._messages, colors))


def diff_message(added: Sequence[Any], removed: Sequence[str], head: Header,
                 messages: Any, colors: Mapping[str, Color] | None = None) -> Any:
    """
    Return the PlanningScene diff that adds CollisionObjects and removes others.

    :param removed: names of objects.
    :param messages: the module moveit_msgs.msg.
    :param colors: {name of an object: its colour from now on}.
    """
    kind = messages.CollisionObject
    scene = messages.PlanningScene(is_diff=True)
    # Otherwise MoveIt would apply the empty robot state.
    scene.robot_state.is_diff = True
    scene.world.collision_objects = [
        kind(header=head, id=name, operation=kind.REMOVE) for name in removed] + [*added]
    scene.object_colors = [
        messages.ObjectColor(id=name, color=ColorRGBA(r=r, g=g, b=b, a=a))
        for name, (r, g, b, a) in sorted((colors or {}).items())]
    return scene


def collision_object(found: DetectedObject, head: Header, shape: str, messages: Any) -> Any:
    """
    Return the CollisionObject of a DetectedObject; its id is the name, such as teacup_7.

    :param shape: 'mesh' = the scaled mesh that was found, 'box' = its bounding box.
    :param messages: the module moveit_msgs.msg.
    """
    kind = messages.CollisionObject
    out = kind(header=head, id=found.name, operation=kind.ADD,
               pose=pose_message(found.translation, found.rotation_xyzw))
    out.type.key = found.category
    here = _here()
    if shape == 'box':
        out.primitives = [SolidPrimitive(type=SolidPrimitive.BOX,
                                         dimensions=found.size.tolist())]
        out.primitive_poses = [here]
    else:
        scale = found.size / np.maximum(found.model.extents, 1e-9)
        out.meshes = [_mesh(found.model.vertices * scale, found.model.faces)]
        out.mesh_poses = [here]
    return out


def unknown_object(found: DetectedUnknown, head: Header, shape: str, messages: Any) -> Any:
    """
    Return the CollisionObject of something of no category; its id is such as unknown_7.

    :param shape: 'mesh' = its convex hull, 'box' = its box.
    :param messages: the module moveit_msgs.msg.
    """
    kind = messages.CollisionObject
    out = kind(header=head, id=found.name, operation=kind.ADD, pose=_here())
    out.type.key = UNKNOWN
    if shape == 'box':
        out.pose = pose_message(found.translation, found.rotation_xyzw)
        out.primitives = [SolidPrimitive(type=SolidPrimitive.BOX,
                                         dimensions=found.size.tolist())]
        out.primitive_poses = [_here()]
    else:
        hull = ConvexHull(found.hull, qhull_options='QJ')
        # Qhull does not order the corners of its faces: these look outwards.
        a, b, c = (found.hull[hull.simplices[:, k]] for k in range(3))
        inwards = np.sum(np.cross(b - a, c - a) * hull.equations[:, :3], axis=1) < 0
        faces = hull.simplices.copy()
        faces[inwards] = faces[inwards][:, ::-1]
        out.meshes = [_mesh(found.hull, faces)]
        out.mesh_poses = [_here()]
    return out


def table_object(outline: PolygonStamped, messages: Any) -> Any:
    """
    Return the CollisionObject `table` of a convex outline; None where it encloses nothing.

    :param outline: corners in order, counter-clockwise seen from above.
    :param messages: the module moveit_msgs.msg.
    """
    top = np.array([(p.x, p.y, p.z) for p in outline.polygon.points]).reshape(-1, 3)
    n = len(top)
    normal = np.cross(top, np.roll(top, -1, axis=0)).sum(0) if n else np.zeros(3)
    if n < 3 or not np.linalg.norm(normal):
        return None
    normal /= np.linalg.norm(normal)
    vertices = np.concatenate([top - TABLE_GAP_M * normal,
                               top - (TABLE_GAP_M + TABLE_THICKNESS_M) * normal])
    faces = [(0, k, k + 1) for k in range(1, n - 1)]
    faces += [(n, n + k + 1, n + k) for k in range(1, n - 1)]
    for k in range(n):
        after = (k + 1) % n
        faces += [(k, n + k, n + after), (k, n + after, after)]
    kind = messages.CollisionObject
    out = kind(header=outline.header, id='table', operation=kind.ADD, pose=_here())
    out.type.key = 'table'
    out.meshes = [_mesh(vertices, np.array(faces, np.uint32))]
    out.mesh_poses = [_here()]
    return out


def _here() -> Pose:
    """Return the identity."""
    pose = Pose()
    pose.orientation.w = 1.0
    return pose


def _mesh(vertices: Float64Array, faces: AnyArray) -> Mesh:
    """Return the shape_msgs Mesh of vertices (V, 3) in metres and faces (F, 3)."""
    return Mesh(vertices=[Point(x=x, y=y, z=z) for x, y, z in vertices.tolist()],
                triangles=[MeshTriangle(vertex_indices=face)
                           for face in faces.astype(np.uint32)])

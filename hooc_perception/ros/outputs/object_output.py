# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The topics objects/* and scene/*: the result, for programs and viewers."""

from collections.abc import Sequence
import colorsys
import json

from geometry_msgs.msg import Pose, PoseArray
from hooc_perception.chain import topic_token
from hooc_perception.core.parsing.unexplained import Unexplained
from hooc_perception.core.types import GenericModel, ParsedScene
from hooc_perception.ros.lifecycle.stage_node import StageNode
from hooc_perception.ros.messages.conversions import header, pose_array_message, pose_message
from hooc_perception.ros.messages.point_clouds import cloud_message, row_dtype
from hooc_perception.ros.messages.stages import (
    labels_json,
    Meshes,
    OBJECT_COLUMNS,
    objects_messages,
    points_message,
)
from hooc_perception.ros.messages.unknown import UNKNOWN_COLUMNS, unknown_messages
from hooc_perception.ros.outputs.detected import DetectedScene, DetectedUnknown, UNKNOWN
import numpy as np
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Header, String
from visualization_msgs.msg import Marker, MarkerArray


class ObjectOutput:
    """
    Publish results.

    :param models: class id c is models[c - 1].
    :param meshes: (URI, sha256 in hex) of each member of their families.
    """

    def __init__(self, node: StageNode, models: Sequence[GenericModel],
                 meshes: Sequence[Meshes]) -> None:
        """Create the publishers."""
        self.models, self.meshes = models, meshes
        self._shown: set[tuple[str, int]] = set()   # (ns, id) of the markers in viewers
        self._poses = node.publisher(PoseArray, 'objects/poses')
        self._attributes = node.publisher(PointCloud2, 'objects/attributes')
        self._labels = node.publisher(String, 'objects/labels')
        self._by_category = [
            node.publisher(PoseArray, 'objects/<category>/poses',
                           f'objects/{topic_token(model.name)}/poses') for model in models]
        self._unknown = node.publisher(PoseArray, 'objects/unknown')
        self._unknown_attributes = node.publisher(PointCloud2, 'objects/unknown_attributes')
        self._markers = node.publisher(MarkerArray, 'objects/markers')
        self._unexplained = node.publisher(PointCloud2, 'scene/unexplained')
        self._summary = node.publisher(String, 'scene/summary')

    def announce(self) -> None:
        """Latch the meaning of the class ids before the first result."""
        self._labels.publish(String(data=labels_json(self.models, self.meshes)))

    def publish(self, parsed: ParsedScene, scene: DetectedScene, age_s: float,
                unexplained: Unexplained) -> None:
        """
        Publish one result; `objects/poses` goes last: once it has arrived, so has the rest.

        :param scene: the same with ids, stamp and frame.
        :param age_s: seconds since the stamp.
        :param unexplained: in the target frame.
        """
        head, found = scene.header, parsed.objects
        ids = np.array([o.id for o in scene.objects], np.uint32)
        unknown_poses, unknown_attributes = unknown_messages(
            parsed.unknown, np.array([u.id for u in scene.unknown], np.uint32), age_s, head)
        poses, attributes = objects_messages(parsed, ids, age_s, head)
        self._labels.publish(String(data=labels_json(self.models, self.meshes, ids, found)))
        self._attributes.publish(attributes)
        for class_id, publisher in enumerate(self._by_category, 1):
            mine = found.take(found.category == class_id)
            publisher.publish(pose_array_message(mine.translation, mine.rotation_xyzw, head))
        self._unknown_attributes.publish(unknown_attributes)
        self._unknown.publish(unknown_poses)
        self._markers.publish(self._markers_message(list(poses.poses), parsed, scene))
        self._unexplained.publish(points_message(
            unexplained.points, head, reason=unexplained.reason))
        self._summary.publish(String(data=summary_json(parsed, scene.stamp_ns)))
        self._poses.publish(poses)

    def clear(self, stamp_ns: int, frame: str) -> None:
        """Retract the last result: empty messages on every topic, no markers."""
        head = header(stamp_ns, frame)
        attributes, unexplained = empty_clouds(head)
        self._labels.publish(String(data=labels_json(self.models, self.meshes)))
        self._attributes.publish(attributes)
        for publisher in self._by_category:
            publisher.publish(PoseArray(header=head))
        self._unknown_attributes.publish(empty_unknown(head))
        self._unknown.publish(PoseArray(header=head))
        # DELETEALL also removes the markers of a predecessor that died.
        self._markers.publish(MarkerArray(markers=[
            *self._deleted(set(), head), Marker(header=head, action=Marker.DELETEALL)]))
        self._unexplained.publish(unexplained)
        self._summary.publish(String(data=summary_json(None, stamp_ns)))
        self._poses.publish(PoseArray(header=head))

    def _deleted(self, now: set[tuple[str, int]], head: Header) -> list[Marker]:
        """Return a DELETE for each (ns, id) that was shown and is not in `now`; remember `now`."""
        gone, self._shown = sorted(self._shown - now), now
        return [Marker(header=head, ns=ns, id=number, action=Marker.DELETE) for ns, number in gone]

    def _markers_message(self, poses: Sequence[Pose], parsed: ParsedScene,
                         scene: DetectedScene) -> MarkerArray:
        """Return DELETE for the markers of objects that are gone, ADD for the current ones."""
        head, found = scene.header, parsed.objects
        hidden = np.zeros(len(found)) if parsed.hidden_s is None else parsed.hidden_s
        markers = self._deleted({(o.category, o.id) for o in scene.objects}
                                | {(UNKNOWN, u.id) for u in scene.unknown}, head)
        for i, (number, model) in enumerate(zip((o.id for o in scene.objects),
                                                found.shapes(self.models))):
            class_id, member = int(found.category[i]), int(found.member[i])
            marker = Marker(header=head, ns=model.name, id=int(number), action=Marker.ADD,
                            type=Marker.MESH_RESOURCE, pose=poses[i],
                            mesh_resource=self.meshes[class_id - 1][member][0])
            scale = found.size[i] / model.extents
            marker.scale.x, marker.scale.y, marker.scale.z = (float(s) for s in scale)
            hue = class_id * 0.618034 % 1.0     # golden ratio: adjacent ids differ
            marker.color.r, marker.color.g, marker.color.b = colorsys.hsv_to_rgb(hue, 0.6, 0.95)
            marker.color.a = 0.3 if hidden[i] > 0 else 0.8
            markers.append(marker)
        markers += [box_marker(u, head) for u in scene.unknown]
        return MarkerArray(markers=markers)


def box_marker(thing: DetectedUnknown, head: Header) -> Marker:
    """Return the grey, translucent box of something of no category."""
    marker = Marker(header=head, ns=UNKNOWN, id=thing.id, action=Marker.ADD, type=Marker.CUBE,
                    pose=pose_message(thing.translation, thing.rotation_xyzw))
    marker.scale.x, marker.scale.y, marker.scale.z = (float(s) for s in thing.size)
    marker.color.r = marker.color.g = marker.color.b = 0.6
    marker.color.a = 0.6
    return marker


def empty_unknown(head: Header) -> PointCloud2:
    """Return an empty `objects/unknown_attributes`."""
    return cloud_message(np.zeros(0, row_dtype(UNKNOWN_COLUMNS)), head)


def empty_clouds(head: Header) -> tuple[PointCloud2, PointCloud2]:
    """Return empty `objects/attributes` and `scene/unexplained`."""
    return (cloud_message(np.zeros(0, row_dtype(OBJECT_COLUMNS)), head),
            points_message(np.zeros((0, 3)), head, reason=np.zeros(0, np.uint8)))


def summary_json(parsed: ParsedScene | None, stamp_ns: int) -> str:
    """Return the text of `scene/summary`: statistics of a result; None = it is retracted."""
    summary = {'format': 'hooc-summary/1', 'stamp_ns': stamp_ns,
               'energy': dict.fromkeys(('total', 'depth', 'probability', 'overlap')),
               'converged': False, 'candidates': 0, 'seconds': {}}
    if parsed is not None:
        energy = parsed.energy
        summary.update(
            energy={'total': float(energy.total), 'depth': float(energy.depth),
                    'probability': float(energy.probability), 'overlap': float(energy.overlap)},
            converged=bool(parsed.converged), candidates=len(parsed.pool),
            seconds={name: float(s) for name, s in parsed.seconds.items()})
    return json.dumps(summary)

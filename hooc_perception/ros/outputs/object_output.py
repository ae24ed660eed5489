# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The topics objects/* and scene/*: the answer, for programs and for viewers."""

import colorsys
import json

from geometry_msgs.msg import PoseArray
from hooc_perception.chain import topic_token
from hooc_perception.ros.messages.conversions import header, pose_array_message
from hooc_perception.ros.messages.point_clouds import cloud_message, row_dtype
from hooc_perception.ros.messages.stages import (
    labels_json,
    OBJECT_COLUMNS,
    objects_messages,
    points_message,
)
import numpy as np
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import String
from visualization_msgs.msg import Marker, MarkerArray


class ObjectOutput:
    """
    Publish answers.

    :param models: tuple of GenericModel; class id c is models[c - 1].
    :param meshes: one (URI, sha256 in hex) a model.
    """

    def __init__(self, node, models, meshes):
        """Create the publishers on a StageNode."""
        self.models, self.meshes = models, meshes
        self._shown = set()
        self._poses = node.publisher(PoseArray, 'objects/poses')
        self._attributes = node.publisher(PointCloud2, 'objects/attributes')
        self._labels = node.publisher(String, 'objects/labels')
        self._by_category = [
            node.publisher(PoseArray, 'objects/<category>/poses',
                           f'objects/{topic_token(model.name)}/poses') for model in models]
        self._markers = node.publisher(MarkerArray, 'objects/markers')
        self._unexplained = node.publisher(PointCloud2, 'scene/unexplained')
        self._summary = node.publisher(String, 'scene/summary')

    def announce(self):
        """Latch what the class ids mean, before there is any answer."""
        self._labels.publish(String(data=labels_json(self.models, self.meshes)))

    def publish(self, parsed, ids, stamp_ns, frame, age_s, unexplained):
        """
        Publish one answer; `objects/poses` goes last, so that whoever waits for it has all.

        :param ids: (n,) uint32 instance ids.
        :param age_s: seconds since the stamp.
        :param unexplained: (n, 3) world points.
        """
        head, found = header(stamp_ns, frame), parsed.objects
        poses, attributes = objects_messages(parsed, ids, age_s, head)
        self._labels.publish(String(data=labels_json(self.models, self.meshes, ids,
                                                     found.category)))
        self._attributes.publish(attributes)
        for class_id, publisher in enumerate(self._by_category, 1):
            mine = found.take(found.category == class_id)
            publisher.publish(pose_array_message(mine.translation, mine.rotation_xyzw, head))
        self._markers.publish(self._markers_message(poses, found, ids, head))
        self._unexplained.publish(points_message(unexplained, head))
        self._summary.publish(String(data=summary_json(parsed, stamp_ns)))
        self._poses.publish(poses)

    def clear(self, stamp_ns, frame):
        """Take the last answer back: empty messages on every topic, no markers."""
        head = header(stamp_ns, frame)
        attributes, unexplained = empty_clouds(head)
        self._labels.publish(String(data=labels_json(self.models, self.meshes)))
        self._attributes.publish(attributes)
        for publisher in self._by_category:
            publisher.publish(PoseArray(header=head))
        # What a predecessor that died has left in a viewer goes with DELETEALL.
        self._markers.publish(MarkerArray(markers=[
            *self._deleted(set(), head), Marker(header=head, action=Marker.DELETEALL)]))
        self._unexplained.publish(unexplained)
        self._summary.publish(String(data=summary_json(None, stamp_ns)))
        self._poses.publish(PoseArray(header=head))

    def _deleted(self, now, head):
        """Return a DELETE for each (ns, id) that was shown and is not in `now`; remember `now`."""
        gone, self._shown = sorted(self._shown - now), now
        return [Marker(header=head, ns=ns, id=number, action=Marker.DELETE) for ns, number in gone]

    def _markers_message(self, poses, found, ids, head):
        """Return DELETE for what was shown and is gone, ADD for what stands there now."""
        markers = self._deleted({(self.models[c - 1].name, int(number))
                                 for c, number in zip(found.category, ids)}, head)
        for i, number in enumerate(ids):
            class_id = int(found.category[i])
            model = self.models[class_id - 1]
            marker = Marker(header=head, ns=model.name, id=int(number), action=Marker.ADD,
                            type=Marker.MESH_RESOURCE, pose=poses.poses[i],
                            mesh_resource=self.meshes[class_id - 1][0])
            scale = found.size[i] / model.extents
            marker.scale.x, marker.scale.y, marker.scale.z = (float(s) for s in scale)
            hue = class_id * 0.618034 % 1.0     # golden ratio: neighbours differ
            marker.color.r, marker.color.g, marker.color.b = colorsys.hsv_to_rgb(hue, 0.6, 0.95)
            marker.color.a = 0.8
            markers.append(marker)
        return MarkerArray(markers=markers)


def empty_clouds(head):
    """Return `objects/attributes` and `scene/unexplained` where nothing is known to stand."""
    return (cloud_message(np.zeros(0, row_dtype(OBJECT_COLUMNS)), head),
            points_message(np.zeros((0, 3)), head))


def summary_json(parsed, stamp_ns):
    """Return the text of `scene/summary`: how the answer came about; None: there is no answer."""
    energy = {name: parsed and float(getattr(parsed.energy, name))
              for name in ('total', 'depth', 'probability', 'overlap')}
    return json.dumps({
        'format': 'hooc-summary/1', 'stamp_ns': stamp_ns, 'energy': energy,
        'converged': bool(parsed and parsed.converged),
        'candidates': len(parsed.pool) if parsed else 0,
        'seconds': {name: float(s) for name, s in parsed.seconds.items()} if parsed else {}})

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""vision_msgs: the objects as 3D detections."""

from geometry_msgs.msg import PoseWithCovariance, Vector3
from hooc_perception.ros.messages.conversions import pose_message
from hooc_perception.ros.outputs.adapters.guard import messages_of
from hooc_perception.ros.outputs.detected import DetectedScene
import numpy as np
from scipy.stats import chi2


class Detections:
    """Publish objects/detections."""

    def __init__(self, node):
        """Create the publisher on a StageNode; HoocError without vision_msgs."""
        self._messages = messages_of('vision_msgs', 'publish_detections')
        self._publisher = node.publisher(self._messages.Detection3DArray, 'objects/detections')

    def publish(self, scene):
        """Publish a DetectedScene."""
        self._publisher.publish(detections_message(scene, self._messages))

    def clear(self, stamp_ns, frame):
        """Take the last answer back."""
        self.publish(DetectedScene(stamp_ns, frame, ()))


def detections_message(scene, messages):
    """
    Return the Detection3DArray of a DetectedScene.

    `class_id` is the category's name, `id` the instance. Each object has one hypothesis.
    """
    array = messages.Detection3DArray(header=scene.header)
    for o in scene.objects:
        pose = pose_message(o.translation, o.rotation_xyzw)
        hypothesis = messages.ObjectHypothesis(class_id=o.category, score=o.score)
        x, y, z = o.size.tolist()
        array.detections.append(messages.Detection3D(
            header=scene.header, id=str(o.id),
            bbox=messages.BoundingBox3D(center=pose, size=Vector3(x=x, y=y, z=z)),
            results=[messages.ObjectHypothesisWithPose(
                hypothesis=hypothesis, pose=PoseWithCovariance(
                    pose=pose, covariance=covariance(o.sigma_t, o.sigma_r)))]))
    return array


def covariance(sigma_t, sigma_r):
    """
    Return (36,) float64 for PoseWithCovariance, of the radii that hold 68 % of the errors.

    All zeros, which in ROS means unknown (sensor_msgs/Imu), unless both are known.
    """
    if not np.isfinite([sigma_t, sigma_r]).all():
        return np.zeros(36)
    variances = np.square([sigma_t, sigma_r]) / chi2.ppf(0.68, 3)
    return np.diag(np.repeat(variances, 3)).ravel()

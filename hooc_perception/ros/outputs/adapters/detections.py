# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The objects as 3D detections of vision_msgs."""

from typing import Any

from geometry_msgs.msg import PoseWithCovariance, Vector3
from hooc_perception.core.arrays import Float64Array
from hooc_perception.ros.lifecycle.stage_node import StageNode
from hooc_perception.ros.messages.conversions import pose_message
from hooc_perception.ros.outputs.adapters.guard import messages_of
from hooc_perception.ros.outputs.detected import DetectedScene
import numpy as np
from scipy.stats import chi2


class Detections:
    """Publish objects/detections."""

    def __init__(self, node: StageNode) -> None:
        """Create the publisher; HoocError without vision_msgs."""
        self._messages = messages_of('vision_msgs', 'publish_detections')
        self._publisher = node.publisher(self._messages.Detection3DArray, 'objects/detections')

    def publish(self, scene: DetectedScene) -> None:
        """Publish a result."""
        self._publisher.publish(detections_message(scene, self._messages))

    def clear(self, stamp_ns: int, frame: str) -> None:
        """Retract the last result."""
        self.publish(DetectedScene(stamp_ns, frame, ()))


def detections_message(scene: DetectedScene, messages: Any) -> Any:
    """
    Return the Detection3DArray of a result.

    `class_id` is the name of the category, `id` the instance. Each object has one hypothesis.

    :param messages: the module vision_msgs.msg.
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


def covariance(sigma_t: float, sigma_r: float) -> Float64Array:
    """
    Return the (36,) float64 of a PoseWithCovariance.

    All zeros, which ROS defines as unknown (sensor_msgs/Imu), unless both radii are known.

    :param sigma_t: radius, m, within which 68 % of the errors lie.
    :param sigma_r: the same for the rotation, rad.
    """
    if not np.isfinite([sigma_t, sigma_r]).all():
        return np.zeros(36)
    variances = np.square([sigma_t, sigma_r]) / chi2.ppf(0.68, 3)
    return np.diag(np.repeat(variances, 3)).ravel()

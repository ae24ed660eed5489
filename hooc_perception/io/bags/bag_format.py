# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What reading and writing bags share: message types, storage plugins, QoS profiles."""

from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import StoragePlugin
from rosbags.typesys import get_typestore, Stores

TYPES = get_typestore(Stores.ROS2_JAZZY)
STORAGES = {'mcap': StoragePlugin.MCAP, 'sqlite3': StoragePlugin.SQLITE3}
# Version of metadata.yaml that is written.
METADATA_VERSION = 9
IMAGE = 'sensor_msgs/msg/Image'
CAMERA_INFO = 'sensor_msgs/msg/CameraInfo'
TRANSFORM = 'geometry_msgs/msg/TransformStamped'
TF = 'tf2_msgs/msg/TFMessage'
STRING = 'std_msgs/msg/String'
_INFINITE = QosTime(9223372036, 854775807)


def offered_qos(latched: bool) -> Qos:
    """Return the reliable profile of a topic: transient local if latched, else volatile."""
    return Qos(QosHistory.KEEP_LAST, 1 if latched else 10, QosReliability.RELIABLE,
               QosDurability.TRANSIENT_LOCAL if latched else QosDurability.VOLATILE,
               _INFINITE, _INFINITE, QosLiveliness.AUTOMATIC, _INFINITE, False)

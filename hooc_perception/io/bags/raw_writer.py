# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Record messages as they come off the wire, as a rosbag2 bag."""

from pathlib import Path

from hooc_perception.errors import HoocError
from hooc_perception.io.bags import mcap_file
from hooc_perception.io.bags.writer import STORAGES
from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import Writer
from rosbags.typesys import get_typestore, Stores

_TYPES = get_typestore(Stores.ROS2_JAZZY)
_INFINITE = QosTime(9223372036, 854775807)


class RawBagWriter:
    """Write serialized messages; use as a context manager."""

    def __init__(self, path, storage='mcap'):
        """Create the bag; HoocError where there is one already."""
        path = Path(path)
        if path.exists():
            raise HoocError(f'{path}: exists already; remove it or choose another folder')
        path.parent.mkdir(parents=True, exist_ok=True)
        self._path = path / f'{path.name}.mcap'
        self._writer = Writer(path, version=9, storage_plugin=STORAGES[storage])
        self._writer.open()
        self._connections = {}

    def __enter__(self):
        """Return the writer."""
        return self

    def __exit__(self, *_):
        """Finish the bag."""
        self._writer.close()
        if self._path.is_file():
            mcap_file.seal(self._path)

    def write(self, topic, type_name, data, time_ns, latched=False):
        """
        Add one message.

        :param type_name: such as sensor_msgs/msg/Image.
        :param data: its CDR bytes.
        """
        if topic not in self._connections:
            self._connections[topic] = self._writer.add_connection(
                topic, type_name, typestore=_TYPES, offered_qos_profiles=[Qos(
                    QosHistory.KEEP_LAST, 1 if latched else 10, QosReliability.RELIABLE,
                    QosDurability.TRANSIENT_LOCAL if latched else QosDurability.VOLATILE,
                    _INFINITE, _INFINITE, QosLiveliness.AUTOMATIC, _INFINITE, False)])
        self._writer.write(self._connections[topic], time_ns, data)

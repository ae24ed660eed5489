# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Record serialized messages as a rosbag2 bag."""

from pathlib import Path

from hooc_perception.errors import HoocError
from hooc_perception.io.bags.bag_format import METADATA_VERSION, offered_qos, STORAGES, TYPES
from hooc_perception.io.bags.mcap_checks import write_checksums
from rosbags.interfaces import Connection
from rosbags.rosbag2 import Writer


class RawBagWriter:
    """Write serialized messages; use as a context manager."""

    def __init__(self, path: str | Path, storage: str = 'mcap') -> None:
        """Create the bag; raise HoocError if it exists."""
        path = Path(path)
        if path.exists():
            raise HoocError(f'{path}: exists already; remove it or choose another folder')
        path.parent.mkdir(parents=True, exist_ok=True)
        self._path = path / f'{path.name}.mcap'
        self._writer = Writer(path, version=METADATA_VERSION, storage_plugin=STORAGES[storage])
        self._writer.open()
        self._connections: dict[str, Connection] = {}

    def __enter__(self) -> 'RawBagWriter':
        """Return the writer."""
        return self

    def __exit__(self, *_: object) -> None:
        """Finish the bag."""
        self._writer.close()
        if self._path.is_file():
            write_checksums(self._path)

    def write(self, topic: str, type_name: str, data: bytes, time_ns: int,
              latched: bool = False) -> None:
        """
        Add one message.

        :param type_name: such as sensor_msgs/msg/Image.
        :param data: its CDR bytes.
        """
        if topic not in self._connections:
            self._connections[topic] = self._writer.add_connection(
                topic, type_name, typestore=TYPES, offered_qos_profiles=[offered_qos(latched)])
        self._writer.write(self._connections[topic], time_ns, data)

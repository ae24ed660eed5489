# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Open bags of any origin and iterate over their messages; what is wrong becomes a sentence."""

from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from hooc_perception.errors import HoocError
from hooc_perception.io.bags import mcap_file
from hooc_perception.io.scenes import files
from rosbags.interfaces import QosDurability, QosReliability
from rosbags.rosbag2 import Reader
from rosbags.typesys import get_typestore, Stores

TYPES = get_typestore(Stores.ROS2_JAZZY)


@dataclass(frozen=True)
class BagTopic:
    """
    One topic of a bag.

    :ivar type_name: such as sensor_msgs/msg/Image.
    :ivar latched: True where its publisher kept messages for late subscribers.
    :ivar reliable: False where its publisher offered best effort.
    """

    name: str
    type_name: str
    count: int
    latched: bool
    reliable: bool


@dataclass(frozen=True)
class BagMessage:
    """One message: `data` is CDR as it was recorded, `time_ns` when."""

    topic: BagTopic
    time_ns: int
    data: bytes

    def read(self, path):
        """Return the deserialized message; `path` names the bag in the error."""
        try:
            return TYPES.deserialize_cdr(self.data, self.topic.type_name)
        # The bytes are a stranger's, and rosbags fails on them in many ways.
        except Exception:
            raise HoocError(f'{path}: a message of {self.topic.name} is damaged or not of type '
                            f'{self.topic.type_name}; record or copy the bag again') from None


def topics(path):
    """Return {topic name: BagTopic} of a bag."""
    with _reading(path) as reader:
        return {connection.topic: _topic(connection) for connection in reader.connections}


def iter_messages(path, names=None):
    """
    Yield every BagMessage of a bag in the order of time.

    :param path: a rosbag2 folder, or its .mcap or .db3 file.
    :param names: topic names to keep, None = all.
    :raises HoocError: where the bag is missing, truncated or no bag.
    """
    with _reading(path) as reader:
        chosen = [c for c in reader.connections if names is None or c.topic in names]
        known = {connection.id: _topic(connection) for connection in chosen}
        # An empty choice would mean "all" to rosbags.
        for connection, time_ns, data in reader.messages(chosen) if chosen else ():
            yield BagMessage(known[connection.id], time_ns, bytes(data))


@contextmanager
def _reading(path):
    """Open a bag; whatever rosbags raises on a stranger's bytes becomes a HoocError."""
    path = Path(path)
    if not path.exists():
        raise HoocError(f'{path}: there is no such bag; give a rosbag2 folder or an .mcap file')
    if path.is_dir() and not (path / 'metadata.yaml').is_file():
        raise HoocError(f'{path}: metadata.yaml is missing, so this is no rosbag2 folder or its '
                        'recording was cut off; run "ros2 bag reindex" or record again')
    if path.is_dir():
        # Size and depth are bounded here; rosbags would take anything.
        _check_compression(path, files.read_yaml(path / 'metadata.yaml'))
    for file in path.glob('*.mcap') if path.is_dir() else [path]:
        if file.suffix == '.mcap' and file.is_file():
            mcap_file.check(file)
    try:
        with Reader(path) as reader:
            yield reader
    except (HoocError, GeneratorExit, KeyboardInterrupt):
        raise
    except Exception as error:
        reason = ' '.join(str(error).split())[:160] or type(error).__name__
        raise HoocError(f'{path}: the bag is truncated, damaged or no bag ({reason}); '
                        'copy it again, or save what is left with hooc doctor --salvage') from None


def _check_compression(path, metadata):
    """Refuse whole files and single messages that are compressed: their size has no bound."""
    info = metadata.get('rosbag2_bagfile_information')
    mode = str(info.get('compression_mode') or '').lower() if isinstance(info, dict) else ''
    if mode not in ('', 'none', 'storage'):
        raise HoocError(f'{path}: the bag is compressed by {mode}; rewrite it with "ros2 bag '
                        'convert" (MCAP with its own compression is read)')


def _topic(connection):
    """Return the BagTopic of a rosbags connection; unknown QoS counts as reliable."""
    profiles = connection.ext.offered_qos_profiles
    return BagTopic(
        connection.topic, connection.msgtype, connection.msgcount,
        bool(profiles) and all(q.durability == QosDurability.TRANSIENT_LOCAL for q in profiles),
        all(q.reliability != QosReliability.BEST_EFFORT for q in profiles))

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Open bags of any origin and iterate over their messages; every failure is a HoocError."""

from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hooc_perception.errors import HoocError
from hooc_perception.io.bags.bag_format import TYPES
from hooc_perception.io.bags.mcap_checks import check_mcap
from hooc_perception.io.scenes import files
from rosbags.interfaces import (
    Connection,
    ConnectionExtRosbag2,
    QosDurability,
    QosReliability,
)
from rosbags.rosbag2 import Reader


@dataclass(frozen=True)
class BagTopic:
    """
    One topic of a bag.

    :ivar type_name: such as sensor_msgs/msg/Image.
    :ivar latched: True if its publisher kept messages for late subscribers.
    :ivar reliable: False if its publisher offered best effort.
    """

    name: str
    type_name: str
    count: int
    latched: bool
    reliable: bool


@dataclass(frozen=True)
class BagMessage:
    """One message: `data` is CDR as recorded, `time_ns` the time of recording."""

    topic: BagTopic
    time_ns: int
    data: bytes

    def read(self, path: str | Path) -> Any:
        """Return the deserialized message; `path` names the bag in the error."""
        try:
            return TYPES.deserialize_cdr(self.data, self.topic.type_name)
        # On damaged bytes rosbags raises almost anything.
        except Exception:
            raise HoocError(f'{path}: a message of {self.topic.name} is damaged or not of type '
                            f'{self.topic.type_name}; record or copy the bag again') from None


def topics(path: str | Path) -> dict[str, BagTopic]:
    """Return {topic name: BagTopic} of a bag."""
    with _reading(path) as reader:
        return {connection.topic: _topic(connection) for connection in reader.connections}


def iter_messages(path: str | Path, names: Collection[str] | None = None) -> Iterator[BagMessage]:
    """
    Yield every BagMessage of a bag in the order of time.

    :param path: a rosbag2 folder, or its .mcap or .db3 file.
    :param names: topic names to keep, None = all.
    :raises HoocError: if the bag is missing, truncated or not a bag.
    """
    with _reading(path) as reader:
        chosen = [c for c in reader.connections if names is None or c.topic in names]
        known = {connection.id: _topic(connection) for connection in chosen}
        # An empty choice would mean "all" to rosbags.
        for connection, time_ns, data in reader.messages(chosen) if chosen else ():
            yield BagMessage(known[connection.id], time_ns, bytes(data))


@contextmanager
def _reading(path: str | Path) -> Iterator[Reader]:
    """Open a bag; whatever rosbags raises on damaged bytes becomes a HoocError."""
    path = Path(path)
    if not path.exists():
        raise HoocError(f'{path}: there is no such bag; give a rosbag2 folder or an .mcap file')
    if path.is_dir() and not (path / 'metadata.yaml').is_file():
        raise HoocError(f'{path}: metadata.yaml is missing, so this is not a rosbag2 folder or '
                        'its recording was interrupted; run "ros2 bag reindex" or record again')
    if path.is_dir():
        # Size and depth of the YAML are bounded here; rosbags has no limits.
        _check_compression(path, files.read_yaml(path / 'metadata.yaml'))
    for file in path.glob('*.mcap') if path.is_dir() else [path]:
        if file.suffix == '.mcap' and file.is_file():
            check_mcap(file)
    try:
        with Reader(path) as reader:
            yield reader
    except (HoocError, GeneratorExit, KeyboardInterrupt):
        raise
    except Exception as error:
        reason = ' '.join(str(error).split())[:160] or type(error).__name__
        raise HoocError(f'{path}: the bag is truncated, damaged or not a bag ({reason}); '
                        'copy it again, or save what is left with hooc doctor --salvage') from None


def _check_compression(path: Path, metadata: dict[str, Any]) -> None:
    """Reject compression of whole files or single messages: their size has no bound."""
    info = metadata.get('rosbag2_bagfile_information')
    mode = str(info.get('compression_mode') or '').lower() if isinstance(info, dict) else ''
    if mode not in ('', 'none', 'storage'):
        raise HoocError(f'{path}: the bag is compressed by {mode}; rewrite it with "ros2 bag '
                        'convert" (MCAP with its own compression is read)')


def _topic(connection: Connection) -> BagTopic:
    """Return the BagTopic of a rosbags connection; unknown QoS counts as reliable."""
    assert isinstance(connection.ext, ConnectionExtRosbag2)
    profiles = connection.ext.offered_qos_profiles
    return BagTopic(
        connection.topic, connection.msgtype, connection.msgcount,
        bool(profiles) and all(q.durability == QosDurability.TRANSIENT_LOCAL for q in profiles),
        all(q.reliability != QosReliability.BEST_EFFORT for q in profiles))

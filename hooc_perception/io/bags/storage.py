# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
One file of a bag: SQLite, MCAP or a bag of ROS 1, told by its first bytes.

Every message is handed on as the CDR of ROS 2, whatever the file holds, so that nothing behind
this module knows where a recording comes from.
"""

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO, NamedTuple, TypeAlias

from hooc_perception.errors import HoocError
from hooc_perception.io.bags.bag_format import TF, TYPES
from hooc_perception.io.bags.mcap_checks import check_mcap
from hooc_perception.io.bags.mcap_format import MAGIC as MCAP_MAGIC
from hooc_perception.io.bags.zstd import MAGIC as ZSTD_MAGIC
from hooc_perception.io.bags.zstd import unpack_file, unpack_message
from mcap.reader import make_reader, NonSeekingReader
import mcap.records
from rosbags.interfaces import (
    Connection,
    ConnectionExtRosbag1,
    ConnectionExtRosbag2,
    Qos,
    QosDurability,
    QosReliability,
)
from rosbags.rosbag1 import Reader as Ros1Reader
from rosbags.rosbag2.metadata import parse_qos
from rosbags.rosbag2.storage_sqlite3 import Sqlite3Reader

SQLITE_MAGIC, ROS1_MAGIC = b'SQLite format 3\0', b'#ROSBAG V'
CDR, ROS1 = 'cdr', 'ros1'


class Channel(NamedTuple):
    """
    What one publisher recorded on one topic.

    :ivar type_name: in ROS 2's spelling, such as sensor_msgs/msg/Image.
    :ivar encoding: of its messages in the file: 'cdr' or 'ros1'; others are not read.
    :ivar count: number of its messages.
    :ivar latched: True if the publisher kept messages for late subscribers.
    :ivar reliable: False if it offered best effort.
    """

    topic: str
    type_name: str
    encoding: str
    count: int
    latched: bool
    reliable: bool


# Yields (channel, time of recording in ns, CDR bytes) of the messages of some topics.
Messages: TypeAlias = Callable[[Collection[str]], Iterator[tuple[Channel, int, bytes]]]


class Storage(NamedTuple):
    """An open file: its channels, and the messages of chosen topics in the order of time."""

    channels: list[Channel]
    messages: Messages


@contextmanager
def open_storage(path: Path) -> Iterator[Storage]:
    """Open a file of a bag; what is wrong with it raises anything, see `files.reading`."""
    with open(path, 'rb') as file:
        head = file.read(16)
    if head.startswith(ZSTD_MAGIC):
        with open_storage(unpack_file(path)) as storage:
            yield storage
    elif head.startswith(MCAP_MAGIC):
        check_mcap(path)
        with open(path, 'rb') as file:
            yield _mcap(file)
    elif head.startswith(ROS1_MAGIC):
        with _ros1_reader(path) as ros1:
            yield _of_connections(ros1.connections, ros1.messages, ROS1)
    elif head.startswith(SQLITE_MAGIC):
        sqlite = Sqlite3Reader(path)
        sqlite.open()
        try:
            yield _of_connections(sqlite.connections, sqlite.messages, CDR)
        finally:
            sqlite.close()
    else:
        raise ValueError('it is neither MCAP nor SQLite nor a bag of ROS 1')


def ros2_type(name: str) -> str:
    """Return the ROS 2 spelling of a message type: sensor_msgs/Image has no `msg` in ROS 1."""
    package, _, last = name.partition('/')
    last = last.removeprefix('msg/')
    # What /tf carried before tf2: the same bytes under another name.
    return TF if (package, last) == ('tf', 'tfMessage') else f'{package}/msg/{last}'


def as_cdr(data: bytes, type_name: str, encoding: str) -> bytes:
    """
    Return a message as CDR.

    :param type_name: see `ros2_type`.
    :raises Exception: of any kind if the bytes are not of that type.
    """
    if encoding == ROS1:
        return bytes(TYPES.ros1_to_cdr(data, type_name))
    return unpack_message(data)


def qos_of(profiles: Iterable[Qos]) -> tuple[bool, bool]:
    """Return (latched, reliable) of offered QoS profiles; unknown QoS counts as reliable."""
    profiles = list(profiles)
    return (bool(profiles) and all(q.durability == QosDurability.TRANSIENT_LOCAL
                                   for q in profiles),
            all(q.reliability != QosReliability.BEST_EFFORT for q in profiles))


def _ros1_reader(path: Path) -> Ros1Reader:
    """Return the reader of a ROS 1 bag; HoocError if its recording was interrupted."""
    reader = Ros1Reader(path)
    try:
        reader.open()
    except Exception as error:
        if 'not indexed' in str(error):
            raise HoocError(f'{path}: this bag of ROS 1 has no index, since its recording was '
                            'interrupted; write one with "rosbag reindex"') from None
        raise
    reader.close()
    return reader


def _of_connections(
        connections: Iterable[Connection],
        messages: Callable[[list[Connection]], Iterator[tuple[Connection, int, bytes]]],
        encoding: str) -> Storage:
    """Return the Storage of a file that rosbags reads."""
    channels = {}
    for connection in connections:
        ext = connection.ext
        if isinstance(ext, ConnectionExtRosbag1):
            # Old recorders say nothing of latching.
            qos, form = (ext.latching != 0, True), encoding
        else:
            assert isinstance(ext, ConnectionExtRosbag2)
            qos, form = qos_of(ext.offered_qos_profiles), ext.serialization_format
        channels[connection.id] = connection, Channel(
            connection.topic, ros2_type(connection.msgtype), form, connection.msgcount, *qos)

    def chosen(topics: Collection[str]) -> Iterator[tuple[Channel, int, bytes]]:
        wanted = [connection for connection, channel in channels.values()
                  if channel.topic in topics and _is_read(channel)]
        # An empty choice would mean "all" to rosbags.
        for connection, time_ns, data in messages(wanted) if wanted else ():
            channel = channels[connection.id][1]
            yield channel, time_ns, as_cdr(data, channel.type_name, channel.encoding)

    return Storage([channel for _, channel in channels.values()], chosen)


def _mcap(file: BinaryIO) -> Storage:
    """Return the Storage of an MCAP file, of any profile, with or without an index."""
    reader = make_reader(file, validate_crcs=True)
    summary = reader.get_summary()
    counts: dict[int, int] = {}
    indexed = summary is not None and bool(summary.chunk_indexes) and bool(summary.channels)
    if summary and summary.statistics and set(
            summary.statistics.channel_message_counts) <= set(summary.channels):
        counts = summary.statistics.channel_message_counts
        records = [(channel, summary.schemas.get(channel.schema_id))
                   for channel in summary.channels.values()]
    else:
        indexed, (records, counts) = False, _scanned(file)
    channels = {channel.id: _mcap_channel(channel, schema, counts.get(channel.id, 0))
                for channel, schema in records}

    def chosen(topics: Collection[str]) -> Iterator[tuple[Channel, int, bytes]]:
        wanted = {c.topic for c in channels.values() if c.topic in topics and _is_read(c)}
        if not wanted:
            return
        file.seek(0)
        # A file without index is read in its own order: sorting it would need all of it at once.
        source = make_reader(file, validate_crcs=True) if indexed else NonSeekingReader(
            file, validate_crcs=True)
        for _, record, message in source.iter_messages(wanted, log_time_order=indexed):
            channel = channels[record.id]
            if _is_read(channel):
                yield (channel, message.log_time,
                       as_cdr(message.data, channel.type_name, channel.encoding))

    return Storage(list(channels.values()), chosen)


def _scanned(file: BinaryIO) -> tuple[
        list[tuple[mcap.records.Channel, mcap.records.Schema | None]], Counter[int]]:
    """Return the channels with their schemas, and the messages per channel, of a whole file."""
    file.seek(0)
    records, counts = {}, Counter[int]()
    for schema, channel, _ in NonSeekingReader(file, validate_crcs=True).iter_messages(
            log_time_order=False):
        records[channel.id] = channel, schema
        counts[channel.id] += 1
    return list(records.values()), counts


def _mcap_channel(record: mcap.records.Channel, schema: mcap.records.Schema | None,
                  count: int) -> Channel:
    """Return the Channel of an MCAP record."""
    try:
        profiles = parse_qos(record.metadata.get('offered_qos_profiles', ''))
    except Exception:       # YAML of any version, by any recorder; unknown QoS is no damage
        profiles = []
    latched, reliable = qos_of(profiles)
    if record.message_encoding == ROS1:
        latched = record.metadata.get('latching') != '0'
    return Channel(record.topic, ros2_type(schema.name) if schema else '',
                   record.message_encoding, count, latched, reliable)


def _is_read(channel: Channel) -> bool:
    """Return whether messages of a channel can be handed on as CDR."""
    return channel.encoding == CDR or (
        channel.encoding == ROS1 and channel.type_name in TYPES.fielddefs)

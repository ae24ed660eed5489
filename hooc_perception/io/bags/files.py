# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Open bags of any origin and iterate over their messages; every failure is a HoocError."""

from collections import defaultdict
from collections.abc import Collection, Iterator
from contextlib import contextmanager, ExitStack
from dataclasses import dataclass, replace
import heapq
from pathlib import Path
from typing import Any

from hooc_perception.errors import HoocError
from hooc_perception.io.bags.bag_format import TYPES
from hooc_perception.io.bags.folder import bag_files
from hooc_perception.io.bags.storage import Channel, open_storage, Storage
from mcap.stream_reader import CRCValidationError


@dataclass(frozen=True)
class BagTopic:
    """
    One topic of a bag.

    :ivar type_name: such as sensor_msgs/msg/Image.
    :ivar count: number of messages, of all publishers.
    :ivar latched: True if its publishers kept messages for late subscribers.
    :ivar reliable: False if a publisher offered best effort.
    """

    name: str
    type_name: str
    count: int
    latched: bool
    reliable: bool


@dataclass(frozen=True)
class BagMessage:
    """One message: `data` is CDR, whatever was recorded; `time_ns` is the time of recording."""

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
    with _reading(path) as storages:
        return _merged(storages)


def iter_messages(path: str | Path, names: Collection[str] | None = None) -> Iterator[BagMessage]:
    """
    Yield every BagMessage of a bag in the order of time.

    Left out is what cannot be CDR: protobuf or JSON, and messages of ROS 1 of unknown types.

    :param path: a rosbag2 folder, or a .mcap, .db3 or (ROS 1) .bag file, zstd-compressed or not.
    :param names: topic names to keep, None = all.
    :raises HoocError: if the bag is missing, truncated or not a bag.
    """
    with _reading(path) as storages:
        known = _merged(storages)
        wanted = {name for name in known if names is None or name in names}
        parts = [storage.messages(wanted) for storage in storages]
        for channel, time_ns, data in heapq.merge(*parts, key=lambda message: message[1]):
            topic = known[channel.topic]
            if channel.type_name != topic.type_name:
                topic = replace(topic, type_name=channel.type_name)
            yield BagMessage(topic, time_ns, data)


def oddities(path: str | Path) -> list[str]:
    """Return what is odd about the files of a bag though they can be read, in sentences."""
    return bag_files(Path(path))[1]


@contextmanager
def _reading(path: str | Path) -> Iterator[list[Storage]]:
    """Open the files of a bag; whatever is raised on damaged bytes becomes a HoocError."""
    path = Path(path)
    files, _ = bag_files(path)
    try:
        with ExitStack() as stack:
            yield [stack.enter_context(open_storage(file)) for file in files]
    except (HoocError, GeneratorExit, KeyboardInterrupt):
        raise
    except Exception as error:
        reason = ('a checksum differs' if isinstance(error, CRCValidationError)
                  else ' '.join(str(error).split())[:160] or type(error).__name__)
        raise HoocError(f'{path}: the bag is truncated, damaged or not a bag ({reason}); '
                        'copy it again, or save what is left with hooc doctor --salvage') from None


def _merged(storages: Collection[Storage]) -> dict[str, BagTopic]:
    """Return {topic name: BagTopic} of several files and publishers."""
    channels: defaultdict[str, list[Channel]] = defaultdict(list)
    for storage in storages:
        for channel in storage.channels:
            channels[channel.topic].append(channel)
    return {name: _topic(name, found) for name, found in channels.items()}


def _topic(name: str, channels: list[Channel]) -> BagTopic:
    """Return the BagTopic of all channels of a name; those without messages say nothing."""
    speaking = [channel for channel in channels if channel.count] or channels
    most = max(speaking, key=lambda channel: channel.count)
    return BagTopic(name, most.type_name, sum(channel.count for channel in channels),
                    all(channel.latched for channel in speaking),
                    all(channel.reliable for channel in speaking))

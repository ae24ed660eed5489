# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What is recorded off the wire is a bag like any other."""

from hooc_perception.errors import HoocError
from hooc_perception.io.bags.files import iter_messages, topics, TYPES
from hooc_perception.io.bags.raw_writer import RawBagWriter
import pytest


def test_bytes_come_back(tmp_path):
    text = TYPES.types['std_msgs/msg/String']('two words')
    data = bytes(TYPES.serialize_cdr(text, 'std_msgs/msg/String'))
    with RawBagWriter(tmp_path / 'bag') as writer:
        writer.write('/a', 'std_msgs/msg/String', data, 5)
        writer.write('/b', 'std_msgs/msg/String', data, 7, latched=True)
        writer.write('/a', 'std_msgs/msg/String', data, 9)
    found = topics(tmp_path / 'bag')
    assert {name: (t.count, t.latched) for name, t in found.items()} == {
        '/a': (2, False), '/b': (1, True)}
    messages = list(iter_messages(tmp_path / 'bag'))
    assert [m.time_ns for m in messages] == [5, 7, 9]
    assert all(m.read('bag').data == 'two words' for m in messages)


def test_nothing_is_overwritten(tmp_path):
    with pytest.raises(HoocError, match='exists already'):
        RawBagWriter(tmp_path)

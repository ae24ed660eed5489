# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Check a bag for everything that prevents or degrades parsing it."""

from collections.abc import Iterator
from pathlib import Path

from hooc_perception.diagnosis.finding import ERROR, Finding, OK, WARNING
from hooc_perception.diagnosis.geometry import check_geometry
from hooc_perception.diagnosis.streams import (
    check_latched,
    check_stream,
    check_synchrony,
    IMAGE,
    read_streams,
)
from hooc_perception.errors import HoocError
from hooc_perception.io.bags.camera_topics import bag_camera, depth_topics
from hooc_perception.io.bags.files import topics
from hooc_perception.io.bags.notes import read_notes
from hooc_perception.io.bags.salvage import salvage_bag


def check_bag(path: Path) -> Iterator[Finding]:
    """Yield a Finding for each check of a bag (a rosbag2 folder, an .mcap or .db3 file)."""
    try:
        known, notes = topics(path), read_notes(path)
        firsts, infos, streams = read_streams(path, known, notes.depth_unit)
    except HoocError as error:
        yield Finding(ERROR, 'bag', str(error))
        yield from check_remains(path)
        return
    yield Finding(OK, 'bag', f'{sum(t.count for t in known.values())} messages on '
                  f'{len(known)} topics')
    try:
        cameras = depth_topics(firsts, infos, path)
    except HoocError as error:
        yield Finding(ERROR, 'cameras', str(error))
        return
    sound = True
    for name, topic in cameras.items():
        for finding in check_stream(topic, streams[topic], known[topic]):
            sound &= finding.level != ERROR
            yield Finding(finding.level, name, finding.text)
        try:
            bag_camera(name, topic, infos, firsts[topic], path, notes.rectified.of(name))
        except HoocError as error:
            sound = False
            yield Finding(ERROR, name, str(error))
    yield from check_synchrony({name: streams[topic].stamps for name, topic in cameras.items()})
    yield from check_latched(known)
    if sound:
        yield from check_geometry(path)


def check_remains(path: Path) -> Iterator[Finding]:
    """Yield how much of a damaged bag can still be read."""
    try:
        found = salvage_bag(path, keep=False)
    except HoocError as error:
        yield Finding(ERROR, 'salvage', str(error))
        return
    for note in list(dict.fromkeys(found.notes))[:5]:
        yield Finding(WARNING, 'damage', f'{note}; copy the bag again if there is another copy')
    if found.counts:
        yield Finding(WARNING, 'salvage', f'{found.counts.total()} messages, '
                      f'{found.counts[IMAGE]} of them images, can still be read; save them with '
                      '--salvage NEW_BAG')
    else:
        yield Finding(ERROR, 'salvage', 'no message can be read any more; record again')

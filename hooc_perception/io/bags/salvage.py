# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Save what can be read of a damaged bag into a new one."""

from contextlib import closing
from pathlib import Path
import sqlite3
import struct

from hooc_perception.errors import HoocError
from hooc_perception.io.bags import mcap_file
from hooc_perception.io.bags.files import TYPES
from hooc_perception.io.bags.raw_writer import RawBagWriter

# Rows of a database that are missing in a row before its end is believed.
MOST_MISSING = 1000
MOST_DATABASE_BYTES = 1 << 30


def salvaged(path, keep=True):
    """
    Return the mcap_file.Salvage of a bag: its messages that can be read, in the order of time.

    :param path: a rosbag2 folder, with or without metadata.yaml, or its .mcap or .db3 file.
    :param keep: False counts the messages without keeping them.
    :raises HoocError: where there is no such file.
    """
    path = Path(path)
    files = sorted(p for p in path.iterdir() if p.suffix in ('.mcap', '.db3')) if (
        path.is_dir()) else [path]
    files = [file for file in files if file.is_file()]
    if not files:
        raise HoocError(f'{path}: there is no .mcap or .db3 file, so nothing can be salvaged; '
                        'look for the recording elsewhere')
    found = mcap_file.Salvage(sum(file.stat().st_size for file in files), keep, _readable)
    for file in files:
        (_salvage_database if file.suffix == '.db3' else mcap_file.salvage)(file, found)
    found.messages.sort(key=lambda entry: entry[3])
    return found


def write_salvaged(found, out):
    """Write the messages of a Salvage as a new bag; HoocError where there is one already."""
    with RawBagWriter(out) as writer:
        for topic, kind, data, time_ns, latched in found.messages:
            writer.write(topic, kind, data, time_ns, latched)


def _readable(kind, data):
    """Return whether a message can be decoded."""
    try:
        TYPES.deserialize_cdr(data, kind)
        return True
    except Exception:       # damaged bytes fail in many ways; foreign types are not written
        return False


def _salvage_database(path, found):
    """Add to a Salvage what an SQLite bag holds, row by row around what is damaged."""
    try:
        with closing(sqlite3.connect(':memory:')) as base:
            base.deserialize(_padded(path))
            topics = _topics(base)
            # Found by their number, rows are reached past a page that is damaged.
            missing, number = 0, 0
            while missing < MOST_MISSING and not found.full:
                number += 1
                row = _row(base, number, found)
                missing = 0 if row else missing + 1
                if row and row[0] in topics:
                    topic, kind, latched = topics[row[0]]
                    found.add(topic, kind, bytes(row[2]), int(row[1]), latched)
    except (sqlite3.Error, TypeError, ValueError) as error:
        reason = ' '.join(str(error).split())[:120]
        found.note(f'the database cannot be read further ({reason})')


def _padded(path):
    """Return a database file's bytes, filled up with zeros where it was cut off."""
    if path.stat().st_size > MOST_DATABASE_BYTES:
        raise ValueError('it has more than one gigabyte; salvage it with "sqlite3 FILE .recover"')
    data = path.read_bytes()
    if len(data) < 100 or not data.startswith(b'SQLite format 3\0'):
        raise ValueError('it is no SQLite database')
    # SQLite refuses any page of a file that is shorter than its header says.
    page, = struct.unpack_from('>H', data, 16)
    pages, = struct.unpack_from('>I', data, 28)
    size = (65536 if page == 1 else page) * pages
    return data.ljust(min(size, 4 * len(data) + (64 << 20)), b'\0')


def _topics(base):
    """Return {id: (topic, type, latched)}."""
    return {i: (name, kind, 'durability: 1' in profile or 'transient_local' in profile)
            for i, name, kind, profile in base.execute(
                'SELECT id, name, type, offered_qos_profiles FROM topics LIMIT 10000')}


def _row(base, number, found):
    """Return (topic id, time, data) of a message's row, None where it is not to be had."""
    try:
        return base.execute('SELECT topic_id, timestamp, data FROM messages WHERE id = ?',
                            (number,)).fetchone()
    except sqlite3.Error:
        found.note('a row of the database is damaged')
        return None

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Save the readable messages of a damaged bag in a new bag."""

from contextlib import closing
from pathlib import Path
import sqlite3
import struct

from hooc_perception.errors import HoocError
from hooc_perception.io.bags.bag_format import TYPES
from hooc_perception.io.bags.folder import storage_files
from hooc_perception.io.bags.mcap_salvage import Salvage, salvage_mcap, SalvagedMessage
from hooc_perception.io.bags.raw_writer import RawBagWriter
from hooc_perception.io.bags.storage import as_cdr, CDR
from hooc_perception.io.bags.zstd import SUFFIXES, unpack_file

# A database is taken to end after this many missing rows in succession.
MAX_MISSING_ROWS = 1000
MAX_DATABASE_BYTES = 1 << 30


def salvage_bag(path: str | Path, keep: bool = True) -> Salvage:
    """
    Return the readable messages of a bag in the order of time.

    :param path: a rosbag2 folder, with or without metadata.yaml, or its .mcap or .db3 file.
        Of what is compressed with zstd, nothing behind a damaged byte can be recovered.
    :param keep: False counts the messages without keeping them.
    :raises HoocError: if there is no such file.
    """
    path = Path(path)
    files = [file for file in (storage_files(path) if path.is_dir() else [path])
             if file.is_file()]
    if not files:
        raise HoocError(f'{path}: there is no .mcap or .db3 file, so nothing can be salvaged; '
                        'look for the recording elsewhere')
    if files[0].suffix == '.bag':
        raise HoocError(f'{path}: bags of ROS 1 are repaired by "rosbag reindex", on a copy')
    files = [unpack_file(file) if file.suffix in SUFFIXES else file for file in files]
    found = Salvage(sum(file.stat().st_size for file in files), keep, _readable)
    for file in files:
        (_salvage_database if file.suffix == '.db3' else salvage_mcap)(file, found)
    found.messages.sort(key=lambda message: message.time_ns)
    return found


def write_salvaged(found: Salvage, out: str | Path) -> None:
    """Write the messages of a Salvage as a new bag; raise HoocError if `out` exists."""
    with RawBagWriter(out) as writer:
        for message in found.messages:
            writer.write(message.topic, message.type_name, message.data, message.time_ns,
                         message.latched)


def _readable(type_name: str, data: bytes) -> bool:
    """Return whether a message can be decoded."""
    try:
        TYPES.deserialize_cdr(data, type_name)
        return True
    except Exception:       # damaged bytes fail in many ways; unknown types are not written
        return False


def _salvage_database(path: Path, found: Salvage) -> None:
    """Add to a Salvage the messages of an SQLite bag, row by row around what is damaged."""
    try:
        with closing(sqlite3.connect(':memory:')) as base:
            base.deserialize(_padded(path))
            topics = _topics(base)
            # Rows are addressed by number, which also reaches those behind a damaged page.
            missing, number = 0, 0
            while missing < MAX_MISSING_ROWS and not found.full:
                number += 1
                row = _row(base, number, found)
                missing = 0 if row else missing + 1
                if row and row[0] in topics:
                    topic, type_name, latched = topics[row[0]]
                    data = as_cdr(bytes(row[2]), type_name, CDR)
                    found.add(SalvagedMessage(topic, type_name, data, int(row[1]), latched))
    except (sqlite3.Error, TypeError, ValueError) as error:
        reason = ' '.join(str(error).split())[:120]
        found.note(f'the database cannot be read further ({reason})')


def _padded(path: Path) -> bytes:
    """Return a database file's bytes, filled up with zeros if the file is truncated."""
    if path.stat().st_size > MAX_DATABASE_BYTES:
        raise ValueError('it has more than one gigabyte; salvage it with "sqlite3 FILE .recover"')
    data = path.read_bytes()
    if len(data) < 100 or not data.startswith(b'SQLite format 3\0'):
        raise ValueError('it is not an SQLite database')
    # SQLite rejects every page of a file that is shorter than its header says.
    page, = struct.unpack_from('>H', data, 16)
    pages, = struct.unpack_from('>I', data, 28)
    size = (65536 if page == 1 else page) * pages
    return data.ljust(min(size, 4 * len(data) + (64 << 20)), b'\0')


def _topics(base: sqlite3.Connection) -> dict[int, tuple[str, str, bool]]:
    """Return {id: (topic, type, latched)}."""
    return {i: (name, type_name, 'durability: 1' in profile or 'transient_local' in profile)
            for i, name, type_name, profile in base.execute(
                'SELECT id, name, type, offered_qos_profiles FROM topics LIMIT 10000')}


def _row(base: sqlite3.Connection, number: int, found: Salvage) -> tuple[int, int, bytes] | None:
    """Return (topic id, time, data) of a message's row, None if it cannot be read."""
    try:
        return base.execute('SELECT topic_id, timestamp, data FROM messages WHERE id = ?',
                            (number,)).fetchone()
    except sqlite3.Error:
        found.note('a row of the database is damaged')
        return None

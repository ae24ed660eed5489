# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Free shared memory of killed processes."""

from contextlib import suppress
import fcntl
import os
from pathlib import Path
import re
import time

FOLDER = Path('/dev/shm')
YOUNG_S = 5.0
# The lock file of a Fast DDS segment; the owner holds the lock as long as it lives.
_LOCK_FILE = re.compile(r'fastrtps_[0-9a-f]{16}_el')


def free_orphans(folder: Path = FOLDER) -> int:
    """
    Remove the Fast DDS segments of this user whose owners have died; return their bytes.

    Fast DDS leaves them behind if a process is killed: 64 MB each with our profile, so that a
    node that keeps dying would fill the memory of the machine. Processes that have one mapped
    are not affected.

    :param folder: where shared memory is mounted.
    """
    freed = 0
    for lock in Path(folder).glob('fastrtps_*_el'):
        if not _LOCK_FILE.fullmatch(lock.name):
            continue
        with suppress(OSError):
            status = lock.stat()
            # A segment that is being created has no lock yet.
            if status.st_uid != os.getuid() or time.time() - status.st_mtime < YOUNG_S:
                continue
            with open(lock, 'rb') as file:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)    # fails while it lives
                segment = lock.with_name(lock.name.removesuffix('_el'))
                with suppress(FileNotFoundError):
                    freed += segment.stat().st_size
                    segment.unlink()
                lock.unlink()
    return freed

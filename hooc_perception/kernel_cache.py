# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""A place for numba's compiled kernels where the package itself cannot be written to."""

import os
from pathlib import Path
import tempfile


def writable(folder):
    """Say whether files can be made in `folder`, or in its closest ancestor that exists."""
    folder = Path(folder)
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    return folder.is_dir() and os.access(folder, os.W_OK | os.X_OK)


def private_folder(base):
    """
    Return a folder below `base` that only this user can write to.

    What lies in it is run as code, so a folder that someone else put there is not trusted.
    """
    folder = Path(base) / f'hooc_perception-kernels-{os.getuid()}'
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        found = folder.lstat()
        if folder.is_symlink() or found.st_uid != os.getuid() or found.st_mode & 0o022:
            raise PermissionError
    except OSError:
        folder = Path(tempfile.mkdtemp(prefix='hooc_perception-kernels-', dir=base))
    return folder


def choose(environment=os.environ, package=Path(__file__).parent, temporary=None):
    """
    Set NUMBA_CACHE_DIR where numba would find no place for its cache, else leave it alone.

    numba tries the package's folder and then the user's cache folder by itself; a service account
    in a read-only installation has neither, and every kernel would fail to import.
    """
    if environment.get('NUMBA_CACHE_DIR') or writable(package):
        return
    home = environment.get('XDG_CACHE_HOME') or os.path.expanduser('~/.cache')
    if not writable(home):
        environment['NUMBA_CACHE_DIR'] = str(private_folder(temporary or tempfile.gettempdir()))

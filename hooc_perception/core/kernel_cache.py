# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Where numba keeps compiled kernels, and when they are out of date."""

from collections.abc import Mapping, MutableMapping
import contextlib
import hashlib
import os
from pathlib import Path
import tempfile


def writable(folder: str | Path) -> bool:
    """Say whether files can be made in `folder`, or in its closest ancestor that exists."""
    folder = Path(folder)
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    return folder.is_dir() and os.access(folder, os.W_OK | os.X_OK)


def private_folder(base: str | Path) -> Path:
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


PACKAGE = Path(__file__).resolve().parents[1]


def prepare() -> None:
    """Choose the folder of compiled kernels, drop stale ones; before numba is first imported."""
    choose()
    drop_stale()
    # The TBB that other libraries bring along is too old for numba, which would warn and go on.
    os.environ.setdefault('NUMBA_THREADING_LAYER_PRIORITY', 'omp workqueue tbb')


def choose(environment: MutableMapping[str, str] = os.environ, package: Path = PACKAGE,
           temporary: str | Path | None = None) -> None:
    """
    Set NUMBA_CACHE_DIR where numba would find no place for its cache, else leave it alone.

    numba tries the package's folder and then the user's cache folder by itself; a service account
    in a read-only installation has neither, and every kernel would fail to import.
    """
    if environment.get('NUMBA_CACHE_DIR') or writable(package):
        return
    if not writable(_home(environment)):
        environment['NUMBA_CACHE_DIR'] = str(private_folder(temporary or tempfile.gettempdir()))


def drop_stale(environment: Mapping[str, str] = os.environ, package: Path = PACKAGE) -> None:
    """
    Remove compiled kernels that were made from other sources than lie there now.

    numba compiles a kernel anew where its own file has changed, not where a kernel of another
    file that it calls has: after an update, old code would run inside of new.
    """
    now = hashlib.sha256()
    for source in sorted(package.glob('**/kernels/*.py')):
        state = source.stat()
        name = source.relative_to(package).as_posix()
        now.update(f'{name} {state.st_mtime_ns} {state.st_size}\n'.encode())
    root, folders = _place(environment, package)
    # In the package's own cache folder, which git and builds leave out.
    stamp = root / '__pycache__' / f'{package.name}.sources'
    with contextlib.suppress(OSError):
        if stamp.exists() and stamp.read_text() == now.hexdigest():
            return
        stamp.parent.mkdir(parents=True, exist_ok=True)
        for folder in folders:
            for index in root.glob(f'{folder}/*.nbi'):
                index.unlink(missing_ok=True)
        stamp.write_text(now.hexdigest())


def _place(environment: Mapping[str, str], package: Path) -> tuple[Path, tuple[str, ...]]:
    """Return (folder for a stamp, patterns below it of folders with compiled kernels)."""
    if not environment.get('NUMBA_CACHE_DIR') and writable(package):
        return package, ('**/kernels/__pycache__', 'synthesis/__pycache__')
    root = environment.get('NUMBA_CACHE_DIR') or Path(_home(environment)) / 'numba'
    return Path(root), ('kernels_*', 'synthesis_*')


def _home(environment: Mapping[str, str]) -> str:
    """Return the folder of the user's caches."""
    return environment.get('XDG_CACHE_HOME') or os.path.expanduser('~/.cache')

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Output paths of the commands, checked before the work begins."""

import os
from pathlib import Path

from hooc_perception.errors import HoocError


def file_place(path: str | Path | None, option: str) -> Path | None:
    """
    Return the Path of a file to write, None for None.

    :param option: its option on the command line, such as `--out`.
    :raises HoocError: where no file can be written there.
    """
    if path is None:
        return None
    path = Path(path)
    if path.is_dir():
        raise HoocError(f'{option} {path} is a folder; name a file')
    return _within_reach(path, path.parent, option)


def folder_place(path: str | Path | None, option: str) -> Path | None:
    """Return the Path of a folder to write into, None for None; HoocError as `file_place`."""
    if path is None:
        return None
    path = Path(path)
    if path.exists() and not path.is_dir():
        raise HoocError(f'{option} {path} is a file; name a folder')
    return _within_reach(path, path, option)


def page_place(path: str | Path | None, option: str) -> Path | None:
    """Return the Path of an HTML file, or of a folder for it; HoocError as `file_place`."""
    if path is not None and Path(path).suffix.lower() in ('.html', '.htm'):
        return file_place(path, option)
    place = folder_place(path, option)
    if place is not None:
        file_place(place / 'report.html', option)
    return place


def relative_place(path: str | Path, file: str | Path) -> str:
    """Return `path` as seen from the folder of `file`, so that both can be moved together."""
    return os.path.relpath(Path(path).resolve(), Path(file).resolve().parent)


def _within_reach(path: Path, folder: Path, option: str) -> Path:
    """Return `path` if `folder` is, or can be made, a folder that may be written into."""
    while not os.path.lexists(folder):
        folder = folder.parent
    if not folder.is_dir():
        raise HoocError(f'{option} {path} cannot be written, because {folder} is not a folder; '
                        'choose another place')
    if not os.access(folder, os.W_OK | os.X_OK):
        raise HoocError(f'{option} {path} cannot be written, because {folder} is write-protected; '
                        'choose another place')
    return path

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Which files make up a bag; metadata.yaml is asked, but not needed."""

from pathlib import Path, PurePath
import re

from hooc_perception.errors import HoocError
from hooc_perception.io.bags.zstd import SUFFIXES as ZSTD_SUFFIXES
from hooc_perception.io.scenes import files

SUFFIXES = ('.mcap', '.db3', '.bag')
METADATA = 'metadata.yaml'


def is_bag(path: Path) -> bool:
    """Return whether a path names a bag: a file of one, or a folder that holds such files."""
    if path.is_dir():
        return (path / METADATA).is_file() or bool(storage_files(path))
    return path.is_file() and _is_storage(path)


def bag_files(path: Path) -> tuple[list[Path], list[str]]:
    """
    Return the files of a bag in their order, and what is odd about its metadata, in sentences.

    The files that lie there count: rosbag2 loses or empties metadata.yaml when a recorder is
    killed, and `ros2 bag reindex` writes it with other counts and identifiers.

    :raises HoocError: if there is no such bag, or several.
    """
    if not path.exists():
        raise HoocError(f'{path}: there is no such bag; give a rosbag2 folder, or an .mcap, .db3 '
                        'or .bag file')
    if not path.is_dir():
        return [path], []
    there = storage_files(path)
    if not there:
        raise HoocError(f'{path}: there is no .mcap, .db3 or .bag file in it, so this is no bag; '
                        'give the folder or file of a recording')
    if not (path / METADATA).is_file():
        _check_parts(path, there)
        return there, [f'{path}: {METADATA} is missing, so its files are read without it; '
                       '"ros2 bag reindex" writes it for other tools']
    try:
        listed, unknown = _listed(path)
    except HoocError as error:
        _check_parts(path, there)
        return there, [f'{error}; the files are read without it']
    if unknown:
        raise HoocError(f'{path}: the bag is compressed with {unknown}, and only zstd is read; '
                        'rewrite it with "ros2 bag convert"')
    found = [file for file in listed if file.is_file()]
    missing = [file.name for file in listed if not file.is_file()]
    if not found:
        return there, [f'{path}: {METADATA} lists {", ".join(missing) or "no file"}, but '
                       f'{", ".join(file.name for file in there)} lies there and is read; '
                       '"ros2 bag reindex" corrects the list']
    return found, [f'{path}: {", ".join(missing)} of the recording is missing, so only '
                   f'{", ".join(file.name for file in found)} is read; copy the whole folder'
                   ] if missing else []


def storage_files(folder: Path) -> list[Path]:
    """Return the files of bags in a folder, part 2 before part 10, each once."""
    there = [file for file in folder.iterdir() if file.is_file() and _is_storage(file)]
    plain = {file.name for file in there}
    # Players leave the unpacked file beside the compressed one.
    return sorted((file for file in there
                   if file.suffix not in ZSTD_SUFFIXES or file.stem not in plain),
                  key=lambda file: [int(part) if part.isdigit() else part
                                    for part in re.split(r'(\d+)', file.name)])


def _listed(path: Path) -> tuple[list[Path], str | None]:
    """Return the files that metadata.yaml lists, and the name of an unknown compression."""
    # Size and depth of the YAML are bounded here.
    info = files.read_yaml(path / METADATA).get('rosbag2_bagfile_information')
    if not isinstance(info, dict):
        raise HoocError(f'{path / METADATA}: it does not describe a bag; "ros2 bag reindex" '
                        'writes it anew')
    names = info.get('relative_file_paths')
    names = [str(name) for name in names] if isinstance(names, list) else []
    mode = str(info.get('compression_mode') or 'none').lower()
    form = str(info.get('compression_format') or '').lower()
    packed = mode in ('file', 'message') and form not in ('', 'zstd')
    # Only names count: a bag that was moved may list absolute paths.
    return [path / PurePath(name).name for name in names], form if packed else None


def _is_storage(file: Path) -> bool:
    """Return whether a file's name is that of a part of a bag."""
    suffix = PurePath(file.stem).suffix if file.suffix in ZSTD_SUFFIXES else file.suffix
    return suffix in SUFFIXES


def _check_parts(path: Path, there: list[Path]) -> None:
    """Raise HoocError if files without metadata are not the parts of one recording."""
    stems = {re.sub(r'_\d+$', '', file.name.partition('.')[0]) for file in there}
    if len(stems) > 1:
        raise HoocError(f'{path}: {METADATA} is missing and its files are several recordings '
                        f'({", ".join(file.name for file in there[:4])}); name one of them')

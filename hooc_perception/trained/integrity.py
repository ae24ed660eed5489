# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Checks that make a MODEL folder of unknown origin safe to read.

Names are plain file names, files lie inside the folder and match their checksums, arrays hold
plain numbers and have the size that their headers declare. Nothing is unpickled.
"""

from collections.abc import Mapping
import hashlib
import math
from pathlib import Path
import re
from typing import NamedTuple
import zipfile

from hooc_perception.core.arrays import AnyArray
from hooc_perception.errors import HoocError
import numpy as np

FILE_NAME = 'model.json'
MAX_FILE_BYTES = 2 * 10**9
# Written archives are not compressed; mesh data never compresses by more than this factor.
MAX_COMPRESSION = 20
SAFE_NAME = re.compile(r'[A-Za-z0-9_][A-Za-z0-9_.-]{0,99}')
# numpy kinds of arrays without objects: bool, integers, floats, text.
PLAIN_KINDS = 'biufU'


class FileRecord(NamedTuple):
    """Size in bytes and hex SHA-256 of a file, as model.json lists them."""

    size: int
    sha256: str


def check_name(name: object, path: Path) -> None:
    """Raise HoocError if a name is not a plain file name."""
    if not SAFE_NAME.fullmatch(str(name)):
        raise HoocError(f'{path} holds the name {str(name)[:60]!r}; use letters, digits, _ . -')


def check_file(folder: Path, name: str, files: Mapping[str, FileRecord]) -> None:
    """Raise HoocError unless the file is inside the folder and matches its size and checksum."""
    if name not in files:
        raise HoocError(f'{folder}/model.json does not list {name}; train again')
    file, declared = folder / name, files[name]
    if not file.is_file():
        raise HoocError(f'{file} is missing; copy the whole model folder or train again')
    real = file.resolve()
    if not real.is_relative_to(folder.resolve()) and real != linked_folder(folder) / name:
        raise HoocError(f'{file} points outside the model folder; copy the file itself')
    if not declared.size == file.stat().st_size <= MAX_FILE_BYTES or (
            sha256_of(file) != declared.sha256):
        raise HoocError(f'{file} is damaged (its checksum differs from model.json); copy it '
                        'again or train again')


def linked_folder(folder: Path) -> Path:
    """
    Return the folder that holds the model.json itself, where that of `folder` is a link.

    `colcon build --symlink-install` mirrors a folder file by file. A link to the file of the same
    name beside that model.json is as safe as opening that folder.
    """
    return (folder / FILE_NAME).resolve().parent


def sha256_of(file: Path) -> str:
    """Return the hex SHA-256 of a file."""
    with open(file, 'rb') as stream:
        return hashlib.file_digest(stream, 'sha256').hexdigest()


def load_plain_array(file: Path) -> AnyArray:
    """Return one .npy array, mapped copy-on-write: writing to it does not change the file."""
    try:
        array = np.load(file, mmap_mode='c', allow_pickle=False)
    except Exception as e:      # numpy fails on damaged bytes in many ways
        raise HoocError(f'{file} is not an array of plain numbers ({short_reason(e)}); '
                        'train again') from e
    if array.dtype.kind not in PLAIN_KINDS:
        raise HoocError(f'{file} holds {array.dtype}, not plain numbers; train again')
    # numba compiles separate code for a np.memmap; a view is a normal array.
    return array.view(np.ndarray)


def load_plain_archive(file: Path) -> dict[str, AnyArray]:
    """Return the arrays of an .npz file; ValueError or any other exception if it is unsafe."""
    with zipfile.ZipFile(file) as archive:
        size = sum(info.file_size for info in archive.infolist())
        if size > min(MAX_FILE_BYTES, MAX_COMPRESSION * file.stat().st_size):
            raise ValueError('its contents are too large')
        for info in archive.infolist():
            _check_header(archive, info)
    with np.load(file, allow_pickle=False) as arrays:
        return {key: arrays[key] for key in arrays.files}


def short_reason(error: Exception) -> str:
    """Return the short text of an exception, in one line."""
    return ' '.join(str(error).split())[:160] or type(error).__name__


def _check_header(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> None:
    """Raise ValueError if an array declares more data than it has: numpy would allocate it."""
    with archive.open(info) as stream:
        version = np.lib.format.read_magic(stream)
        read = {(1, 0): np.lib.format.read_array_header_1_0,
                (2, 0): np.lib.format.read_array_header_2_0}.get(version)
        if read is None:
            raise ValueError(f'{info.filename} has a header of version {version}')
        shape, _, dtype = read(stream)
        if dtype.hasobject or math.prod(shape) * dtype.itemsize > info.file_size:
            raise ValueError(f'{info.filename} is not an array of the size that it declares')

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Damage to bytes and numbers, as on disks and in drivers, or as an attacker would do it."""

from collections.abc import Callable
import struct

from hooc_perception.core.arrays import AnyArray
import numpy as np

LIMITS = (0, 1, 0x7F, 0xFF, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0xFFFFFFFF, 2 ** 40, 2 ** 63 - 1,
          2 ** 64 - 1)
ODD_FLOATS = (0.0, -0.0, np.nan, np.inf, -np.inf, 1e308, -1e308, 1e-320, 1e6, -1.0, 65.535)
ODD_TEXTS = ('', '16UC1', '32FC1', 'mono16', 'rgb8', '32FC4', 'bayer_rggb8', '\0', 'é' * 50,
             '../../etc/passwd', 'a' * 5000, '16UC1; compressedDepth png')


def damaged(data: bytes, rng: np.random.Generator) -> bytes:
    """Return bytes with one to four kinds of damage."""
    spoilt = bytearray(data)
    for _ in range(int(rng.integers(1, 5))):
        _DAMAGES[rng.integers(len(_DAMAGES))](spoilt, rng)
    return bytes(spoilt)


def _bits(data: bytearray, rng: np.random.Generator) -> None:
    """Flip some bits."""
    for _ in range(int(rng.integers(1, 20))):
        if data:
            data[int(rng.integers(len(data)))] ^= 1 << int(rng.integers(8))


def _junk(data: bytearray, rng: np.random.Generator) -> None:
    """Overwrite a slice with random bytes."""
    at, n = _slice(data, rng)
    data[at:at + n] = rng.bytes(n)


def _zeros(data: bytearray, rng: np.random.Generator) -> None:
    """Overwrite a slice with zeros."""
    at, n = _slice(data, rng)
    data[at:at + n] = bytes(n)


def _cut(data: bytearray, rng: np.random.Generator) -> None:
    """Truncate."""
    del data[int(rng.integers(len(data) + 1)):]


def _hole(data: bytearray, rng: np.random.Generator) -> None:
    """Remove a slice."""
    at, n = _slice(data, rng)
    del data[at:at + n]


def _again(data: bytearray, rng: np.random.Generator) -> None:
    """Repeat a slice."""
    at, n = _slice(data, rng)
    data[at:at] = data[at:at + n]


def _limit(data: bytearray, rng: np.random.Generator) -> None:
    """Put an extreme number where a length may be."""
    value = LIMITS[rng.integers(len(LIMITS))]
    form, size = (('<Q', 8), ('<I', 4), ('>I', 4))[rng.integers(3)]
    if len(data) >= size:
        # Headers are where lengths are.
        most = len(data) - size + 1
        at = int(rng.integers(min(most, 400) if rng.random() < 0.5 else most))
        struct.pack_into(form, data, at, value % 2 ** (8 * size))


_DAMAGES: tuple[Callable[[bytearray, np.random.Generator], None], ...] = (
    _bits, _junk, _zeros, _cut, _hole, _again, _limit, _limit)


def _slice(data: bytearray, rng: np.random.Generator) -> tuple[int, int]:
    """Return the start and the length of a random slice."""
    at = int(rng.integers(len(data) + 1))
    return at, int(min(len(data) - at, rng.integers(1, 2000)))


def odd_number(value: float, rng: np.random.Generator) -> float:
    """Return an int or float in place of another one."""
    if isinstance(value, float):
        if rng.random() < 0.3:
            return float(value * 10.0 ** rng.integers(-6, 7))
        return float(ODD_FLOATS[rng.integers(len(ODD_FLOATS))])
    if rng.random() < 0.5:
        return int(LIMITS[rng.integers(len(LIMITS))])
    return max(0, value + int(rng.integers(-3, 4)))


def odd_text(rng: np.random.Generator) -> str:
    """Return an unexpected text."""
    return ODD_TEXTS[rng.integers(len(ODD_TEXTS))]


def odd_array(array: AnyArray, rng: np.random.Generator) -> AnyArray:
    """Return an array with odd numbers in it and sometimes another shape or type."""
    array = np.array(array)
    if not array.size:
        return array
    flat = array.reshape(-1)
    where = rng.integers(len(flat), size=int(rng.integers(1, 50)))
    with np.errstate(all='ignore'):
        if array.dtype.kind in 'iu':
            info = np.iinfo(array.dtype)
            odd = [info.min, info.max, 0, 1, info.max // 2, min(len(flat), info.max)]
            flat[where] = rng.choice(odd, size=len(where)).astype(array.dtype)
        elif array.dtype.kind == 'f':
            flat[where] = rng.choice([np.nan, np.inf, -np.inf, 1e30, -1e30, 0, 1e-30],
                                     size=len(where))
        array, way = flat.reshape(array.shape), rng.integers(6)
        if way == 0 and array.ndim:
            array = array[:len(array) // 2]
        elif way == 1 and array.ndim:
            array = np.concatenate([array, array])
        elif way == 2 and array.ndim > 1:
            array = np.ascontiguousarray(array[..., :-1])
        elif way == 3:
            array = array.astype(rng.choice(['f4', 'f8', 'i4', 'i8', 'u1', 'u2', '?']))
    return array

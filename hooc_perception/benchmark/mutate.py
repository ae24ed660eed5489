# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Damage to bytes and numbers, as it happens on disks and in drivers, and as a foe would do it."""

import struct

import numpy as np

LIMITS = (0, 1, 0x7F, 0xFF, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0xFFFFFFFF, 2 ** 40, 2 ** 63 - 1,
          2 ** 64 - 1)
ODD_FLOATS = (0.0, -0.0, np.nan, np.inf, -np.inf, 1e308, -1e308, 1e-320, 1e6, -1.0, 65.535)
ODD_TEXTS = ('', '16UC1', '32FC1', 'mono16', 'rgb8', '32FC4', 'bayer_rggb8', '\0', 'é' * 50,
             '../../etc/passwd', 'a' * 5000, '16UC1; compressedDepth png')


def damaged(data, rng):
    """Return bytes with one to four kinds of damage."""
    data = bytearray(data)
    for _ in range(int(rng.integers(1, 5))):
        _DAMAGES[rng.integers(len(_DAMAGES))](data, rng)
    return bytes(data)


def _bits(data, rng):
    for _ in range(int(rng.integers(1, 20))):
        if data:
            data[int(rng.integers(len(data)))] ^= 1 << int(rng.integers(8))


def _junk(data, rng):
    at, n = _slice(data, rng)
    data[at:at + n] = rng.bytes(n)


def _zeros(data, rng):
    at, n = _slice(data, rng)
    data[at:at + n] = bytes(n)


def _cut(data, rng):
    del data[int(rng.integers(len(data) + 1)):]


def _hole(data, rng):
    at, n = _slice(data, rng)
    del data[at:at + n]


def _again(data, rng):
    at, n = _slice(data, rng)
    data[at:at] = data[at:at + n]


def _limit(data, rng):
    """Put an extreme number where a length may be."""
    value = LIMITS[rng.integers(len(LIMITS))]
    form, size = (('<Q', 8), ('<I', 4), ('>I', 4))[rng.integers(3)]
    if len(data) >= size:
        # Headers are where the lengths are.
        most = len(data) - size + 1
        at = int(rng.integers(min(most, 400) if rng.random() < 0.5 else most))
        struct.pack_into(form, data, at, value % 2 ** (8 * size))


_DAMAGES = (_bits, _junk, _zeros, _cut, _hole, _again, _limit, _limit)


def _slice(data, rng):
    at = int(rng.integers(len(data) + 1))
    return at, int(min(len(data) - at, rng.integers(1, 2000)))


def odd_number(value, rng):
    """Return an int or float in place of another one."""
    if isinstance(value, float):
        if rng.random() < 0.3:
            return float(value * 10.0 ** rng.integers(-6, 7))
        return float(ODD_FLOATS[rng.integers(len(ODD_FLOATS))])
    if rng.random() < 0.5:
        return int(LIMITS[rng.integers(len(LIMITS))])
    return max(0, value + int(rng.integers(-3, 4)))


def odd_text(rng):
    """Return a text that nobody expects."""
    return ODD_TEXTS[rng.integers(len(ODD_TEXTS))]


def odd_array(array, rng):
    """Return an array with odd numbers in it, and now and then another shape or type."""
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

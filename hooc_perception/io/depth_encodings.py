# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Decode and encode depth images: which values are valid and how many metres they are.

Everything behind this file sees float32 metres with NaN = no reading (REP-118). Scene sets,
bags and the ROS layer all decode here, so that they agree bit for bit.
"""

from typing import Any, TypeAlias

from hooc_perception.core.arrays import AnyArray, Float32Array, UInt16Array
from hooc_perception.errors import HoocError
import numpy as np
import numpy.typing as npt

# collections.abc.Buffer came with Python 3.12.
Buffer: TypeAlias = bytes | bytearray | memoryview | AnyArray | Any

MILLIMETRES = '16UC1'
METRES = '32FC1'
_DTYPES: dict[str, np.dtype[Any]] = {
    MILLIMETRES: np.dtype(np.uint16), 'mono16': np.dtype(np.uint16), METRES: np.dtype(np.float32)}
DEPTH_ENCODINGS = tuple(_DTYPES)


def depth_from_counts(counts: npt.NDArray[np.unsignedinteger],
                      unit: float = 0.001) -> Float32Array:
    """
    Return float32 metres, NaN = none, of integer depth counts of any shape.

    :param counts: unsigned integers, 0 = no reading.
    :param unit: metres per count.
    """
    depth = counts.astype(np.float32) * np.float32(unit)
    depth[counts == 0] = np.nan
    return depth


def counts_from_depth(depth: npt.ArrayLike, unit: float = 0.001) -> UInt16Array:
    """Return uint16 counts, 0 = none, of metres; values that exceed 16 bits become 0."""
    with np.errstate(invalid='ignore'):
        counts = np.rint(np.asarray(depth, np.float64) / unit)
        fits = (counts >= 1) & (counts <= np.iinfo(np.uint16).max)
    return np.where(fits, counts, 0).astype(np.uint16)


def decode_depth(data: Buffer, height: int, width: int, encoding: str, step: int = 0,
                 is_bigendian: bool | int = False, unit: float | None = None) -> Float32Array:
    """
    Return the (height, width) float32 depth in metres, NaN = none, of an image message's data.

    :param data: anything with the buffer protocol (bytes, array, uint8 ndarray).
    :param encoding: '16UC1' or 'mono16' (millimetres, 0 = none) or '32FC1' (metres; NaN,
        infinite and non-positive values = none).
    :param step: bytes per row, 0 = packed rows.
    :param is_bigendian: byte order of `data`.
    :param unit: metres per count or per unit of the floating point number; None = as the
        encoding says.
    :raises HoocError: for another encoding or a buffer that is too short for the image.
    """
    counts_or_metres = decode_image(data, height, width, _dtype(encoding), step, is_bigendian)
    if encoding != METRES:
        return depth_from_counts(counts_or_metres, unit or 0.001)
    depth = counts_or_metres.astype(np.float32)
    if unit is not None:
        depth *= np.float32(unit)
    with np.errstate(invalid='ignore'):
        depth[~(np.isfinite(depth) & (depth > 0))] = np.nan
    return depth


def encoded_unit(encoding: str) -> float:
    """Return the metres per count that a depth encoding means."""
    return 1.0 if encoding == METRES else 0.001


def decode_image(data: Buffer, height: int, width: int, dtype: npt.DTypeLike, step: int = 0,
                 is_bigendian: bool | int = False) -> AnyArray:
    """
    Return the (height, width) pixels of an image message's data, row padding cut off.

    :raises HoocError: if `step` or the buffer is too small for the image.
    """
    dtype = np.dtype(dtype).newbyteorder('>' if is_bigendian else '<')
    row = width * dtype.itemsize
    step = step or row
    flat = np.frombuffer(data, np.uint8)
    if width <= 0 or height <= 0:
        raise HoocError(f'an image of {width} x {height} pixels is empty: check the camera driver')
    if step < row:
        raise HoocError(f'an image of width {width} needs a step of at least {row} bytes, '
                        f'but says step {step}: check the camera driver')
    if flat.size < step * (height - 1) + row:
        raise HoocError(f'an image of {width} x {height} pixels with step {step} needs '
                        f'{step * height} bytes, but has {flat.size}: check the camera driver')
    # as_strided also accepts a last row without padding and steps that split a number.
    rows = np.lib.stride_tricks.as_strided(flat, (height, row), (step, 1), writeable=False)
    return np.ascontiguousarray(rows).view(dtype)


def encode_depth(depth: Float32Array, encoding: str = MILLIMETRES) -> tuple[bytes, int, int]:
    """
    Return (data, step, is_bigendian) of a depth image in metres, for an image message.

    :param depth: (H, W) metres, NaN = none.
    :return: little-endian bytes, bytes per row, 0.
    :raises HoocError: for an encoding that is not a depth encoding.
    """
    dtype = _dtype(encoding)
    pixels = depth if encoding == METRES else counts_from_depth(depth)
    pixels = np.ascontiguousarray(pixels, dtype.newbyteorder('<'))
    return pixels.tobytes(), pixels.shape[1] * dtype.itemsize, 0


def _dtype(encoding: str) -> np.dtype[Any]:
    """Return the pixel type of a depth encoding."""
    if encoding not in _DTYPES:
        raise HoocError(f'encoding {encoding!r} is not a depth encoding: publish '
                        f'{MILLIMETRES} (millimetres) or {METRES} (metres)')
    return _DTYPES[encoding]

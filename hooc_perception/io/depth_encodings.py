# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
The one table of depth encodings: what is valid, how to get metres, how to come back.

Everything behind this file sees float32 metres with NaN = no reading (REP-118). Scene sets,
bags and the ROS layer all decode here, so that they agree bit for bit.
"""

from hooc_perception.errors import HoocError
import numpy as np

# No depth camera measures nearer than this; what does, holds another unit.
NEAREST_M = 0.05
FEW = 0.02
MILLIMETRES = '16UC1'
METRES = '32FC1'
_DTYPES = {MILLIMETRES: np.dtype(np.uint16), 'mono16': np.dtype(np.uint16),
           METRES: np.dtype(np.float32)}


def depth_from_counts(counts, unit=0.001):
    """
    Return float32 metres, NaN = none, of integer depth counts of any shape.

    :param counts: unsigned integers, 0 = no reading.
    :param unit: metres per count.
    """
    depth = counts.astype(np.float32) * np.float32(unit)
    depth[counts == 0] = np.nan
    return depth


def counts_from_depth(depth, unit=0.001):
    """Return uint16 counts, 0 = none, of metres; what does not fit into 16 bits becomes 0."""
    with np.errstate(invalid='ignore'):
        counts = np.rint(np.asarray(depth, np.float64) / unit)
        fits = (counts >= 1) & (counts <= np.iinfo(np.uint16).max)
    return np.where(fits, counts, 0).astype(np.uint16)


def decode_depth(data, height, width, encoding, step=0, is_bigendian=False):
    """
    Return the (height, width) float32 depth in metres, NaN = none, of an image message's data.

    :param data: anything with the buffer protocol (bytes, array, uint8 ndarray).
    :param encoding: '16UC1' or 'mono16' (millimetres, 0 = none) or '32FC1' (metres; NaN,
        infinite and non-positive values = none).
    :param step: bytes a row, 0 = packed rows.
    :param is_bigendian: byte order of `data`, whatever the machine's.
    :raises HoocError: for another encoding or a buffer that does not hold the image.
    """
    counts_or_metres = decode_image(data, height, width, _dtype(encoding), step, is_bigendian)
    if encoding != METRES:
        return depth_from_counts(counts_or_metres)
    depth = counts_or_metres.astype(np.float32)
    with np.errstate(invalid='ignore'):
        depth[~(np.isfinite(depth) & (depth > 0))] = np.nan
    return depth


def decode_image(data, height, width, dtype, step=0, is_bigendian=False):
    """
    Return a read-only (height, width) view of an image message's data, row padding cut off.

    :raises HoocError: where `step` or the buffer's length cannot hold the image.
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
    # as_strided also accepts a last row without its padding and steps that split a number.
    rows = np.lib.stride_tricks.as_strided(flat, (height, row), (step, 1), writeable=False)
    return np.ascontiguousarray(rows).view(dtype)


def encode_depth(depth, encoding=MILLIMETRES):
    """
    Return (data, step, is_bigendian) of a depth image in metres, for an image message.

    :param depth: (H, W) metres, NaN = none.
    :return: little-endian bytes, bytes a row, 0.
    :raises HoocError: for an encoding that is not a depth encoding.
    """
    dtype = _dtype(encoding)
    pixels = depth if encoding == METRES else counts_from_depth(depth)
    pixels = np.ascontiguousarray(pixels, dtype.newbyteorder('<'))
    return pixels.tobytes(), pixels.shape[1] * dtype.itemsize, 0


def _dtype(encoding):
    """Return the pixel type of a depth encoding."""
    if encoding not in _DTYPES:
        raise HoocError(f'encoding {encoding!r} is not a depth encoding: publish '
                        f'{MILLIMETRES} (millimetres) or {METRES} (metres)')
    return _DTYPES[encoding]


def unit_trouble(depth, encoding, max_depth_m):
    """
    Say what is wrong with the unit of a depth image, None where it seems right.

    :param depth: (H, W) float32 metres, NaN = none, as decoded.
    :param encoding: of the message, which promises a unit.
    :param max_depth_m: readings farther away are of no use.
    """
    readings = depth[::4, ::4]
    readings = readings[np.isfinite(readings)]
    if not len(readings):
        return None
    median = float(np.median(readings))
    if (readings <= max_depth_m).mean() < FEW:
        seems = ('millimetres' if median > 100 else None) if encoding == METRES else (
            'a finer unit than millimetres' if median < 65 else 'saturated readings')
        return (f'its readings lie {median:.3g} m away, beyond {max_depth_m:g} m (observe.'
                f'max_depth_m)' + (f', so {encoding} seems to hold {seems}' if seems else '')
                + '; publish 16UC1 in millimetres or 32FC1 in metres')
    if median < NEAREST_M:
        seems = 'metres or centimetres' if encoding != METRES else 'kilometres'
        return (f'its readings lie {1000 * median:.3g} mm away, so {encoding} seems to hold '
                f'{seems}; publish 16UC1 in millimetres or 32FC1 in metres')
    return None

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""PointCloud2 as a table: one row per point, with named and typed columns."""

from collections.abc import Collection, Mapping, Sequence
import textwrap
from typing import Any, cast

from hooc_perception.core.arrays import AnyArray
from hooc_perception.errors import HoocError
from hooc_perception.ros.messages.conversions import message_bytes
import numpy as np
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import Header

_TYPES = {PointField.INT8: 'i1', PointField.UINT8: 'u1', PointField.INT16: 'i2',
          PointField.UINT16: 'u2', PointField.INT32: 'i4', PointField.UINT32: 'u4',
          PointField.FLOAT32: 'f4', PointField.FLOAT64: 'f8'}
_CODES = {np.dtype(code): number for number, code in _TYPES.items()}


def row_dtype(columns: Sequence[tuple[str, str]]) -> np.dtype:
    """
    Return the structured dtype of named columns, every column aligned to its size.

    :param columns: (name, numpy type code) pairs. Wide columns come first in memory; the order
        of the names is kept.
    """
    names, kinds = [c[0] for c in columns], [np.dtype(c[1]) for c in columns]
    offsets, at = [0] * len(names), 0
    for i in sorted(range(len(names)), key=lambda i: -kinds[i].itemsize):
        offsets[i], at = at, at + kinds[i].itemsize
    widest = max(kind.itemsize for kind in kinds)
    return np.dtype({'names': names, 'formats': kinds, 'offsets': offsets,
                     'itemsize': -(-at // widest) * widest})


def cloud_message(rows: AnyArray, head: Header) -> PointCloud2:
    """
    Return the PointCloud2 of a structured (n,) array, one field per column.

    :param rows: columns of the eight types that PointField knows, little-endian.
    """
    dtype = rows.dtype
    layout = cast('Mapping[str, Any]', dtype.fields or {})
    fields = [PointField(name=name, offset=layout[name][1], datatype=_CODES[layout[name][0]],
                         count=1) for name in dtype.names or ()]
    return PointCloud2(header=head, height=1, width=len(rows), fields=fields, is_bigendian=False,
                       point_step=dtype.itemsize, row_step=dtype.itemsize * len(rows),
                       data=message_bytes(rows), is_dense=False)


def cloud_rows(message: PointCloud2, required: Collection[str] = ()) -> AnyArray:
    """
    Return the structured (n,) array of a PointCloud2, one column per field.

    :param required: names of the fields that the cloud must have.
    :raises HoocError: if a field is missing or the sizes are inconsistent.
    """
    order = '>' if message.is_bigendian else '<'
    names = [f.name for f in message.fields]
    missing = [name for name in required if name not in names]
    if missing:
        there = textwrap.shorten(', '.join(map(repr, names)), 200, placeholder=' ...')
        raise HoocError(f'a point cloud has no field {", ".join(missing)} (it has {there}); '
                        'check whether another node publishes on its topic')
    n = message.width * message.height
    if len(message.data) < n * message.point_step:
        raise HoocError(f'a point cloud of {n} points with step {message.point_step} holds only '
                        f'{len(message.data)} bytes; check whether another node publishes on its '
                        'topic')
    try:
        kinds = [np.dtype(order + _TYPES[f.datatype]) for f in message.fields]
        # numpy adds offsets in a C int, which overflows and would read outside of the data.
        if any(f.offset + kind.itemsize > message.point_step
               for f, kind in zip(message.fields, kinds)):
            raise ValueError
        dtype = np.dtype({'names': names, 'formats': kinds,
                          'offsets': [f.offset for f in message.fields],
                          'itemsize': message.point_step})
        return np.frombuffer(message.data, dtype, n)
    except (KeyError, ValueError, OverflowError, TypeError):
        raise HoocError(f'the fields of a point cloud exceed its step of {message.point_step} '
                        'bytes, share a name or have an unknown type; check whether another node '
                        'publishes on its topic') from None

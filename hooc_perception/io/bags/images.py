# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The depth images of a bag as Image messages, whatever transport recorded them."""

from typing import Any, TYPE_CHECKING

from hooc_perception.errors import HoocError
from hooc_perception.io.bags.bag_format import IMAGE, TYPES
from hooc_perception.io.compressed_depth import decode_compressed_depth
import numpy as np

if TYPE_CHECKING:
    from pathlib import Path

    from hooc_perception.io.bags.files import BagMessage, BagTopic

COMPRESSED = 'sensor_msgs/msg/CompressedImage'
# What a transport appends to the topic of the raw image.
TRANSPORTS = ('/compressedDepth', '/compressed')


def may_hold_depth(topic: 'BagTopic') -> bool:
    """Return whether a topic can carry depth images, by its type and name."""
    return topic.type_name == IMAGE or topic.type_name == COMPRESSED and (
        topic.name.endswith(TRANSPORTS[0])
        or topic.name.endswith(TRANSPORTS[1]) and 'depth' in topic.name.lower())


def base_topic(name: str) -> str:
    """Return the topic of the raw image that a transport's topic belongs to."""
    for suffix in TRANSPORTS:
        name = name.removesuffix(suffix)
    return name


def read_image(message: 'BagMessage', path: 'str | Path') -> Any:
    """
    Return the Image message of an image in any transport.

    :raises HoocError: if it is damaged; names bag and topic.
    """
    content = message.read(path)
    if message.topic.type_name != COMPRESSED:
        return content
    try:
        encoding, pixels = decode_compressed_depth(content.format, bytes(content.data))
    except HoocError as error:
        raise HoocError(f'{path}: a message of {message.topic.name} cannot be read: {error}'
                        ) from None
    pixels = np.ascontiguousarray(pixels, pixels.dtype.newbyteorder('<'))
    return TYPES.types[IMAGE](content.header, *pixels.shape, encoding, 0, pixels.strides[0],
                              pixels.reshape(-1).view(np.uint8))

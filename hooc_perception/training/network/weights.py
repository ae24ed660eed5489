# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The trained network over the table that comes with the package."""

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path

from hooc_perception.core.arrays import AnyArray
import numpy as np

FILE = Path(__file__).parent / 'weights.npz'


@lru_cache(maxsize=1)
def bundled() -> dict[str, AnyArray]:
    """Return the arrays of the network that comes with the package."""
    with np.load(FILE, allow_pickle=False) as file:
        return {key: file[key] for key in file.files}


def write(path: Path, arrays: Mapping[str, AnyArray]) -> None:
    """Write the arrays of a network."""
    np.savez_compressed(path, **arrays)  # pyright: ignore[reportArgumentType] (an array each)

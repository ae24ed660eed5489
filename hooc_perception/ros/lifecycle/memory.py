# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Return the memory of what a node has forgotten to the operating system."""

import ctypes
import gc
import sys


def give_back_memory() -> None:
    """Free unreferenced objects and have the C library return their memory to the system."""
    gc.collect()
    if sys.platform == 'linux':
        try:
            ctypes.CDLL('libc.so.6').malloc_trim(0)
        except (OSError, AttributeError):
            pass    # another C library

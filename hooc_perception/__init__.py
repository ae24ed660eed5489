# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Everything that stands on the table: categories and 6D poses from depth alone."""

import os

from hooc_perception import kernel_cache

# Before the first kernel is imported: numba reads its variables only once.
kernel_cache.choose()
kernel_cache.drop_stale()
# The TBB that other libraries bring along is too old for numba, which would warn and go on.
os.environ.setdefault('NUMBA_THREADING_LAYER_PRIORITY', 'omp workqueue tbb')

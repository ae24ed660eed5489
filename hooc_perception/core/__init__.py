# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The method itself: numpy, scipy and numba only, no ROS, no files of users."""

from hooc_perception.core import kernel_cache

# Before the first kernel is imported: numba reads its variables only once.
kernel_cache.prepare()

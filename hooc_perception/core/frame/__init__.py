# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""One frame set as the later stages see it: fused cloud, voxel field, stacked pixels."""

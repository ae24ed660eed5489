# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""A frame set as stages 3 and 4 see it: fused cloud, voxel field, stacked pixels."""

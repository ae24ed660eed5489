# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Numba kernels that stages share: plain arrays in, plain arrays out."""

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Numba kernels: plain arrays in, plain arrays out, one plain reference each in test/."""

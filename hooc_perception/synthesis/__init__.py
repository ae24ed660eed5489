# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Synthetic scenes: training data and a HOOC-like benchmark set."""

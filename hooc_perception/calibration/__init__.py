# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Refine the poses of fixed cameras against each other and the table: `hooc calibrate`."""

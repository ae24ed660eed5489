# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The energy of a set of objects, and the local search that minimizes it."""

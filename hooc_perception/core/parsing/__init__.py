# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Stage 4: which candidates are objects, and how certain that is."""

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Scores against the ground truth, the paper's tables, reports: estimate first, truth second."""

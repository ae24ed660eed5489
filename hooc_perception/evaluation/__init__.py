# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Scores against the truth, the paper's tables, and the report: estimate first, truth second."""

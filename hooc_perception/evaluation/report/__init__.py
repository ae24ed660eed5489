# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The report: one self-contained HTML file with pictures of every scene."""

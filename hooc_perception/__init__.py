# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Everything that stands on the table: categories and 6D poses from depth alone."""

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Stage 4: which candidates stand on the table, and how sure that is."""

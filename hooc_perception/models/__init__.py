# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Generic models: reading, repairing, what is derived from them, and where they are kept."""

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Generic models: reading, repair, derived quantities, the built-in catalogue."""

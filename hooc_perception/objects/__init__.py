# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Generic models: reading, repair, what is derived from them, the built-in catalogue."""

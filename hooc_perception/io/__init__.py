# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Scene sets, bags, depth encodings and frame sets."""

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""How well the poses of fixed cameras fit each other and the table, and how to refine them."""

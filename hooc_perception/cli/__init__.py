# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The `hooc` command: one module per sub-command, imported only when it is chosen."""

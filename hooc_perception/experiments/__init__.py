# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The experiments behind docs/results.md: what is run, when it is run again, what is shown."""

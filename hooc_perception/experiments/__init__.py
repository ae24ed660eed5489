# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The experiments behind docs/results.md: what runs, when it runs again, what is reported."""

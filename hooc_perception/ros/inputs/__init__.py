# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""From camera messages to frame sets and views."""

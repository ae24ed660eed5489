# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Starts the nodes as processes, activates, watches and stops them; runs bags."""

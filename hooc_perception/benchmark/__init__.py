# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Speed and memory of every stage beside named baselines, measured in one run."""

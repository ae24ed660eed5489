# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Speed, memory and robustness of every stage, as ratios to named baselines."""

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Stage 3: pose and size hypotheses per category."""

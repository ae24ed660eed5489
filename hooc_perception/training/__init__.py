# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What is learnt before the first scene: forests from synthetic scenes."""

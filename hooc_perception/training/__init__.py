# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Training: forests and the verifier, learned from synthetic scenes."""

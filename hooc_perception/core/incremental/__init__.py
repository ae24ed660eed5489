# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""From one frame set to the next: what changed, and what stays as it was."""

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Diagnostics: who is silent, who is missing, who is busy."""

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Diagnostics: which node or camera is silent, missing or busy."""

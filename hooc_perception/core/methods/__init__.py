# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The paper's method and the joint method behind one protocol."""

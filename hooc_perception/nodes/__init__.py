# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The five lifecycle nodes: parameters, core object, endpoints; convert, call, publish."""

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The robot in view: its links from a URDF, padded, to be set aside in depth images."""

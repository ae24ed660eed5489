# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Training of the network over the table (core/classification/table_network.py), with PyTorch."""

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Energies of a subset of candidates, and the local search that minimizes them."""

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Read BOP datasets as scene sets."""


def is_bop(path):
    """Say whether a folder looks like a BOP dataset."""
    return False


def load_bop(path):
    """Return (name, categories, scenes)."""
    raise NotImplementedError

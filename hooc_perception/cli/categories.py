# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Whether a model knows the categories of what it is applied to."""

from collections.abc import Sequence
from pathlib import Path
import sys


def category_gap(known: Sequence[str], wanted: Sequence[str], what: str | Path) -> str:
    """
    Return one sentence on how the categories of a model differ, '' where they agree.

    :param known: categories of the model; `wanted`: those of the set or bag.
    :param what: names the set or bag in the sentence.
    """
    parts = [f'{head} {", ".join(names[:5])}{" and more" if len(names) > 5 else ""}'
             for head, names in (
                 ('it does not know', [n for n in wanted if n not in known]),
                 (f'{what} does not list', [n for n in known if n not in wanted])) if names]
    return (f'the model has other categories than {what} ({"; ".join(parts)}); use a model that '
            'was trained for it' if parts else '')


def warn_of_gap(known: Sequence[str], wanted: Sequence[str], what: str | Path) -> None:
    """Print one line on standard error where the categories differ."""
    gap = category_gap(known, wanted, what)
    if gap:
        print(f'[WARN] {gap}', file=sys.stderr)

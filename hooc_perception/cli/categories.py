# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Whether a model knows the categories of what it is applied to."""

import sys


def category_gap(known, wanted, what):
    """
    Return one sentence on how the categories of a model differ, '' where they agree.

    :param known: names that the model knows; `wanted`: those of the set or bag.
    :param what: names the set or bag.
    """
    parts = [f'{head} {", ".join(names[:5])}{" and more" if len(names) > 5 else ""}'
             for head, names in (
                 ('it does not know', [n for n in wanted if n not in known]),
                 (f'{what} does not list', [n for n in known if n not in wanted])) if names]
    return (f'the model has other categories than {what} ({"; ".join(parts)}); use a model that '
            'was trained for it' if parts else '')


def warn_of_gap(known, wanted, what):
    """Say it in one line on standard error where categories differ."""
    gap = category_gap(known, wanted, what)
    if gap:
        print(f'[WARN] {gap}', file=sys.stderr)

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Categories' names in topics and frames, where fewer characters are allowed than in files."""

import re

from hooc_perception.errors import HoocError


def topic_token(name):
    """Return a name as a token that a topic or frame may hold: letters, digits, underscores."""
    token = re.sub(r'[^A-Za-z0-9_]', '_', name)
    return f'_{token}' if token[:1].isdigit() else token


def check_categories(names, where):
    """
    Refuse names of categories of which two become the same token.

    Their answers would be latched on one topic, where each hides the other.

    :param where: begins the sentence.
    :raises HoocError: with both names.
    """
    tokens = {}
    for name in names:
        token = topic_token(name)
        if token in tokens:
            raise HoocError(f'{where}: the categories {tokens[token]!r} and {name!r} would share '
                            f'the topic objects/{token}/poses; rename one of them')
        tokens[token] = name

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""One result of a check."""

from dataclasses import dataclass

OK, WARNING, ERROR = 'ok', 'warning', 'error'


@dataclass(frozen=True)
class Finding:
    """
    What one check found.

    :ivar level: 'ok', 'warning' (works, but worse than it could) or 'error' (will not work).
    :ivar subject: what was looked at: a library, a camera, a topic.
    :ivar text: one sentence; for warnings and errors it ends in the mend, after a semicolon.
    """

    level: str
    subject: str
    text: str


def worst(findings):
    """Return the gravest level of a sequence of Finding, 'ok' for none."""
    levels = (OK, WARNING, ERROR)
    return max((finding.level for finding in findings), key=levels.index, default=OK)

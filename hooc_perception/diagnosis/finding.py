# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The result of one check."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, TypeAlias

Level: TypeAlias = Literal['ok', 'warning', 'error']
OK: Level = 'ok'
WARNING: Level = 'warning'
ERROR: Level = 'error'


@dataclass(frozen=True)
class Finding:
    """
    The result of one check.

    :ivar level: 'ok', 'warning' (works, but not as well as it could) or 'error' (will not work).
    :ivar subject: what was checked: a library, a camera, a topic.
    :ivar text: one sentence; for warnings and errors it ends with the fix, after a semicolon.
    """

    level: Level
    subject: str
    text: str


def worst(findings: Iterable[Finding]) -> Level:
    """Return the most severe level among findings, 'ok' if there are none."""
    levels = {finding.level for finding in findings}
    if ERROR in levels:
        return ERROR
    return WARNING if WARNING in levels else OK

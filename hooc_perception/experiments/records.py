# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What every step took, as it is kept beside the results."""

from collections.abc import Mapping
from dataclasses import dataclass
import json
from pathlib import Path
from typing import Any

from hooc_perception.errors import HoocError

RECORDS = 'steps.json'


@dataclass(frozen=True)
class Record:
    """
    How a step went.

    :ivar key: fingerprint of its command and inputs; `code` of the code that ran.
    :ivar commit: of the source tree at that time, + where it had uncommitted changes.
    :ivar cpu_s: processor seconds of the process and its children; `wall_s` wall time, s.
    :ivar peak_mb: peak memory of the process.
    """

    key: str
    code: str
    commit: str
    cpu_s: float
    wall_s: float
    peak_mb: float


def load_records(root: str | Path) -> dict[str, Record]:
    """
    Return {step name: Record} of what was run before.

    :raises HoocError: where the file is damaged.
    """
    path = Path(root) / RECORDS
    if not path.exists():
        return {}
    try:
        return {name: Record(**entry) for name, entry in json.loads(path.read_text()).items()}
    except (ValueError, TypeError) as e:
        raise HoocError(f'{path} is damaged ({e}); delete it to run every step again') from None


def seconds_per_scene(step: str, result: Mapping[str, Any],
                      records: Mapping[str, Record]) -> float | None:
    """
    Return the processor seconds per scene of a step, None where it was not measured.

    :param result: what the scores file holds of its answer, which counts the scenes.
    """
    record = records.get(step)
    n = len(result.get('scenes', ())) + len(result.get('masks', ()))
    return record.cpu_s / n if record and n else None

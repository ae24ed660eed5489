# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The table of certain but wrong estimates, and of the errors of size and surface."""

from collections.abc import Mapping, Sequence
from typing import Any

from hooc_perception.evaluation.certainty import CERTAIN, certainty_summary
from hooc_perception.evaluation.evaluate import Evaluation
from hooc_perception.evaluation.shape import shape_summary
from hooc_perception.evaluation.tables import Cell, Table

TITLE = 'Certain but wrong, sizes and surfaces'
HEADER = (f'score > {CERTAIN:g}', 'wrong', 'share', 'calibration', 'longest', 'x', 'y', 'z',
          'surface mm')
NOTE = (f'wrong: estimates with a score above {CERTAIN:g} that are not localized, and their share '
        'of all such; calibration: expected calibration error of the scores; longest, x, y, z: '
        'mean |ln(estimated / true)| of the longest side and along the axes of the model; '
        'surface mm: mean distance between the surfaces of the generic model at the estimated '
        'pose and size and at the true pose and size. The last five are over the localized '
        'objects.')


def shape_cells(certainty: Mapping[str, Any], shape: Mapping[str, Any]) -> tuple[Cell, ...]:
    """Return the cells below HEADER, from `certainty_summary` and `shape_summary`."""
    certain, surface = certainty['certain'], shape['surface_m']
    return (certain['estimates'], certain['wrong'], _three(certain['share']),
            _three(certainty['calibration_error']), _three(shape['longest_log']),
            *map(_three, shape['axes_log']),
            None if _three(surface) is None else f'{1000 * surface:.1f}')


def _three(value: float | None) -> str | None:
    """Return a number with three decimals, None for None and NaN."""
    return None if value is None or value != value else f'{value:.3f}'


def shape_table(evaluations: Sequence[Evaluation]) -> Table | None:
    """Return one row per results file; None where no scene has poses."""
    rows: list[tuple[Cell, ...]] = []
    for e in evaluations:
        if e.scores:
            every = [error for errors in e.shapes.values() for error in errors]
            rows.append((e.label or 'results', *shape_cells(certainty_summary(e),
                                                            shape_summary(every))))
    return Table(TITLE, ('results', *HEADER), tuple(rows), (NOTE,)) if rows else None

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Watch now and then whether the cameras agree about the surfaces that two of them see."""

import time
from typing import Any

from hooc_perception.core.extrinsics.residual import pair_residuals, PairResidual
from hooc_perception.core.types import Observation


class RigHealth:
    """
    The residual of each pair of cameras on /diagnostics, under `<camera> + <camera>`.

    :param node: an ingestion node.
    """

    def __init__(self, node: Any) -> None:
        """Check the first Observation that comes."""
        self._node = node
        self._checked: float | None = None

    def check(self, observation: Observation) -> None:
        """Report on an Observation, unless the last report is younger than the period."""
        period = self._node.config.check_extrinsics_s
        now = time.monotonic()
        if not period or (self._checked is not None and now - self._checked < period):
            return
        self._checked = now
        for residual in pair_residuals(observation):
            self._report(residual)

    def _report(self, residual: PairResidual) -> None:
        """Report one pair; what was not measured is neither good nor bad."""
        diagnostics, name = self._node.diagnostics, ' + '.join(residual.names)
        values = {'shift_mm': 1000 * residual.shift_m, 'turn_deg': residual.turn_deg,
                  'surface_mm': 1000 * residual.surface_m, 'agreement': residual.agreement,
                  'common_points': residual.points, 'place_known': residual.place_known}
        diagnostics.values(name, **values)
        if residual.trouble:
            diagnostics.warn(name, 'poses_disagree', residual.trouble)
        elif residual.measured:
            diagnostics.ok(name)
        else:
            diagnostics.state(name, 'not_measured', f'the disagreement is {residual}')

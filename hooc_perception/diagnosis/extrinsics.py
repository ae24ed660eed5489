# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Check whether the cameras agree about the surfaces that two of them see."""

from collections.abc import Iterator

from hooc_perception.core.extrinsics.residual import pair_residuals
from hooc_perception.core.types import Observation
from hooc_perception.diagnosis.finding import Finding, OK, WARNING


def check_pairs(observation: Observation) -> Iterator[Finding]:
    """Yield a Finding on each pair of cameras of one frame set."""
    for residual in pair_residuals(observation):
        name = ' + '.join(residual.names)
        if residual.trouble:
            yield Finding(WARNING, name, residual.trouble)
        else:
            yield Finding(OK, name, f'disagreement of the surfaces that both see: {residual}')

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The support plane on `scene/table`, and in /diagnostics."""

import time
from typing import Any

from geometry_msgs.msg import Point32, PolygonStamped
from hooc_perception.core.segment.table import Table
from hooc_perception.ros.lifecycle.stage_node import StageNode
import numpy as np
from std_msgs.msg import Header

# A table in place is published again after this time: its outline grows as objects go.
AGAIN_S = 5.0


class TableOutput:
    """Publish the outline of the table, latched, when it moves and now and then."""

    def __init__(self, node: StageNode[Any, Any]) -> None:
        """Create the publisher."""
        self._node = node
        self._publisher = node.publisher(PolygonStamped, 'scene/table')
        self._T, self._published = np.full((4, 4), np.nan), -np.inf

    @property
    def due(self) -> bool:
        """Return whether a table in place should be measured and published again."""
        return time.monotonic() - self._published > AGAIN_S

    def moved(self, table: Table) -> bool:
        """Return whether a table is not where the last one was that was published."""
        return not np.array_equal(table.T, self._T)

    def publish(self, table: Table, head: Header) -> None:
        """Publish a Table with stamp and target frame of a set, and report where it is."""
        values: dict[str, float] = {'height_m': table.height_m,
                                    'tilt_deg': float(np.degrees(table.tilt_rad))}
        if np.isfinite(table.residual_m):
            values['residual_mm'] = table.residual_m * 1e3
        if not len(table.outline):
            self._node.diagnostics.warn('table', 'no_table', 'no camera sees a table within the '
                                        'workspace; check the camera poses and the workspace')
        else:
            self._node.diagnostics.ok('table', **values)
        self._publisher.publish(outline_message(table, head))
        self._T, self._published = table.T, time.monotonic()


def outline_message(table: Table, head: Header) -> PolygonStamped:
    """Return the PolygonStamped of a table's outline; no points where it was not seen."""
    message = PolygonStamped(header=head)
    message.polygon.points = [Point32(x=x, y=y, z=z) for x, y, z in table.corners.tolist()]
    return message

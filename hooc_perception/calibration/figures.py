# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""A Calibration as text, as ROS commands and as a picture."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from hooc_perception.calibration.calibrate import Calibration
from hooc_perception.core.arrays import Float64Array
from hooc_perception.core.geometry import back_project, pose_from_matrix
from hooc_perception.core.segment.rectify import rectify
from hooc_perception.core.types import Camera, DepthView
from matplotlib.figure import Figure
import numpy as np

COLOURS = ('#3b6fb6', '#d9822b', '#3f9b62', '#b5495b', '#7b5ea7', '#6b7280')
# What the picture shows: half the side of its square, the height of its side view, metres.
HALF_SIDE_M, LOWEST_M, HIGHEST_M = 0.6, -0.1, 0.4
# The side view is a slice along y = 0 of this thickness.
SLICE_M = 0.02
MOST_POINTS = 20_000


def as_text(result: Calibration) -> Iterator[str]:
    """Yield the lines of the figures before and after."""
    after = 'held out' if result.held_out else 'same scenes'
    yield f'{result.scenes} frame sets; "after" is measured on ' + (
        'frame sets that the poses were not fitted to'
        if result.held_out else 'the frame sets that the poses were fitted to')
    rows = [('camera', 'moved by', 'off the table before', f'after ({after})',
             'difference of two halves')]
    rows += [(f.name, str(f.moved), str(f.table_before), str(f.table_after),
              'reference' if k == 0 and len(result.figures) > 1 else str(f.spread))
             for k, f in enumerate(result.figures)]
    yield from _table(rows)
    if result.pairs:
        yield ''
        rows = [('pair', 'disagreement before', f'after ({after})', 'surfaces before', 'after')]
        rows += [(' + '.join(old.names), str(old), str(new), _mm(old.surface_m),
                  _mm(new.surface_m)) for old, new in result.pairs]
        yield from _table(rows)
    for old, new in result.pairs:
        worse = new.shift_m >= old.shift_m and new.turn_deg >= old.turn_deg
        if worse and not old.trouble:
            yield (f'{" + ".join(old.names)}: no better than before; keep the old poses unless a '
                   'camera has moved')


def as_ros(cameras: Sequence[Camera], frame: str) -> Iterator[str]:
    """Yield, per camera, a static_transform_publisher command and the node parameter."""
    for camera in cameras:
        t, q = pose_from_matrix(camera.T_world_camera)
        words = ' '.join(f'--{key} {value:.6f}' for key, value in zip(
            ('x', 'y', 'z', 'qx', 'qy', 'qz', 'qw'), [*t, *q]))
        yield (f'ros2 run tf2_ros static_transform_publisher {words} --frame-id {frame} '
               f'--child-frame-id {camera.name}_optical_frame')
    yield ''
    yield '# parameters of ingestion_node'
    for camera in cameras:
        numbers = ', '.join(f'{v:.6f}' for v in np.concatenate(
            pose_from_matrix(camera.T_world_camera)))
        yield f'extrinsics.{camera.name}: [{numbers}]'


def write_picture(path: str | Path, views: Sequence[DepthView], result: Calibration) -> None:
    """
    Write a picture of one frame set's points, per camera in a colour: before and after.

    :param views: one DepthView per camera.
    """
    figure = Figure(figsize=(10, 7.2), layout='constrained')
    axes = figure.subplots(2, 2, height_ratios=(3, 1.3))
    for column, (title, cameras) in enumerate((('before', result.before),
                                               ('after', result.cameras))):
        for camera, view, colour in zip(cameras, views, COLOURS * len(views)):
            points = _points(view, camera)
            high = points[points[:, 2] > 0.01]
            high = high[::max(1, len(high) // MOST_POINTS)]
            axes[0, column].scatter(high[:, 0], high[:, 1], s=0.6, lw=0, color=colour, alpha=0.6)
            near = points[np.abs(points[:, 1]) < SLICE_M / 2]
            axes[1, column].scatter(near[:, 0], near[:, 2], s=1.2, lw=0, color=colour,
                                    label=camera.name)
        axes[0, column].set(title=f'{title}: from above', aspect='equal', ylabel='y [m]',
                            xlim=(-HALF_SIDE_M, HALF_SIDE_M), ylim=(-HALF_SIDE_M, HALF_SIDE_M))
        axes[1, column].set(title=f'{title}: slice at y = 0', aspect='equal', xlabel='x [m]',
                            ylabel='z [m]', xlim=(-HALF_SIDE_M, HALF_SIDE_M),
                            ylim=(LOWEST_M, HIGHEST_M))
    axes[1, 1].legend(markerscale=6, fontsize=8, loc='upper right')
    figure.savefig(path, dpi=110)


def _points(view: DepthView, camera: Camera) -> Float64Array:
    """Return the world points (n, 3) of a view for a pose."""
    rectified = rectify(DepthView(camera, view.depth))
    points = back_project(rectified.depth, rectified.camera).reshape(-1, 3)
    return points[np.isfinite(points[:, 2])]


def _mm(metres: float) -> str:
    """Return a distance as text; what was not measured is said to be so."""
    return f'{1000 * metres:.1f} mm' if np.isfinite(metres) else 'not measured'


def _table(rows: Sequence[Sequence[str]]) -> Iterator[str]:
    """Yield the lines of a table with aligned columns, the first row on top."""
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    for row in rows:
        yield '  '.join(text.ljust(width) for text, width in zip(row, widths)).rstrip()

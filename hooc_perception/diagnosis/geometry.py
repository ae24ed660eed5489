# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Check the camera poses of a bag against its table and against a model."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from hooc_perception.core.classification.classify import KIND_PAPER
from hooc_perception.core.segment.checks import pose_trouble, rig_trouble
from hooc_perception.core.segment.config import ObserveConfig
from hooc_perception.core.segment.level import level
from hooc_perception.core.segment.observe import observe
from hooc_perception.core.segment.rectify import rectify
from hooc_perception.core.types import Camera, ObservedView
from hooc_perception.diagnosis.extrinsics import check_pairs
from hooc_perception.diagnosis.finding import ERROR, Finding, OK, WARNING
from hooc_perception.errors import HoocError
from hooc_perception.io.bags.reader import BagScene
import numpy as np

if TYPE_CHECKING:
    from hooc_perception.trained.folder import ModelFolder

# A camera whose pose differs by more than this from the table that it measures gets a warning.
SHIFTED_M, TILTED_DEG = 0.01, 1.0
# Flat objects are lost if the measured heights of the table scatter by more than this.
NOISY_TABLE_MM = 10
MIN_FOREGROUND = 200        # pixels


def check_rig(path: Path, model: 'ModelFolder') -> Iterator[Finding]:
    """Yield whether the cameras of a bag are those that a model was trained for."""
    try:
        cameras = BagScene(path).cameras
    except HoocError:
        return      # check_bag reports it
    yield rig_finding(cameras, model)


def rig_finding(cameras: Sequence[Camera], model: 'ModelFolder') -> Finding:
    """Return whether cameras are those that a model was trained for."""
    kind = model.classifier.get('kind')
    view_bound = kind is not None and np.array_equal(kind, KIND_PAPER)
    trouble = rig_trouble(cameras, model.cameras) if view_bound else None
    return Finding(WARNING if trouble else OK, 'model',
                   trouble or f'{model.name} can be used with these {len(cameras)} cameras')


def check_geometry(path: Path, config: ObserveConfig = ObserveConfig()) -> Iterator[Finding]:
    """Yield a Finding for each check of poses, table and foreground."""
    try:
        bag = BagScene(path)
        for warning in bag.warnings:
            yield Finding(WARNING, 'bag', warning)
        if not bag.table_known:
            yield Finding(WARNING, 'world frame', 'no frame is known to be the table, so it is '
                          'estimated from the depth; publish a frame called "table" on '
                          '/tf_static with z up and z = 0 on its top')
        rectified = [rectify(view, config) for view in bag.views()]
        observation = observe(rectified, config)
    except HoocError as error:
        yield Finding(ERROR, 'geometry', str(error))
        return
    troubled = set()
    for sentence in observation.troubles:
        yield Finding(ERROR, 'table', sentence)
        troubled.update(view.camera.name for view in rectified
                        if sentence.startswith(f'camera {view.camera.name}: '))
    for before, after in zip(rectified, observation.views):
        if before.camera.name not in troubled:
            yield check_view(before.camera, after, config)
    if troubled:
        return      # what follows would compare surfaces that are not the table
    yield from check_pairs(observation)
    noise_mm = 1000 * observation.noise_m
    if not any(np.isfinite(level(view, config, config.workspace_radius_m)[1])
               for view in rectified):
        yield Finding(WARNING, 'table', 'too little of it is seen to measure its noise; check '
                      'that the cameras look at it')
    elif noise_mm > NOISY_TABLE_MM:
        yield Finding(WARNING, 'table', f'its measured heights scatter by {noise_mm:.1f} mm, so '
                      'flat objects are lost; check the sensors and that the table is flat')
    else:
        yield Finding(OK, 'table', f'its measured heights scatter by {noise_mm:.1f} mm')


def check_view(camera: Camera, view: ObservedView, config: ObserveConfig) -> Finding:
    """
    Return the Finding on the pose of one camera.

    :param camera: as calibrated.
    :param view: its view, with the pose corrected to the table.
    """
    name = camera.name
    if trouble := pose_trouble(camera):
        return Finding(ERROR, name, trouble)
    if not view.table.any():
        return Finding(ERROR, name, 'it does not look at the table; check that its extrinsics '
                       'belong to the optical frame (x right, y down, z forward)')
    if view.foreground.sum() < MIN_FOREGROUND:
        return Finding(WARNING, name, 'it sees nothing standing on the table within '
                       f'{config.workspace_radius_m:g} m of the world origin; check the world '
                       'frame')
    T_moved = view.camera.T_world_camera @ np.linalg.inv(camera.T_world_camera)
    shift_mm = 1000 * abs(T_moved[2, 3])
    tilt_deg = np.degrees(np.arccos(np.clip(T_moved[2, 2], -1, 1)))
    if shift_mm > 1000 * SHIFTED_M or tilt_deg > TILTED_DEG:
        return Finding(WARNING, name, f'its pose is {shift_mm:.0f} mm and {tilt_deg:.1f} degrees '
                       'off the table that it measures (corrected); calibrate it again')
    return Finding(OK, name, f'{int(view.foreground.sum())} foreground pixels; its pose fits the '
                   f'table within {shift_mm:.0f} mm and {tilt_deg:.1f} degrees')

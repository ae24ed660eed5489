# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Write meshes and the default rig as a scene set that has no scenes yet."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation
import trimesh
import yaml

RIG = ('kinect1', 'kinect2', 'kinect3')
RIG_DISTANCE_M = 1.1
RIG_TILT_DEG = 38.0
# A typical Kinect v2 depth camera, as its factory calibration gives it.
WIDTH, HEIGHT = 512, 424
K = (365.5, 0.0, 257.0, 0.0, 365.5, 207.5, 0.0, 0.0, 1.0)
D = (0.09, -0.27, 0.0, 0.0, 0.09)


def default_cameras() -> dict[str, dict[str, Any]]:
    """
    Return the entries of cameras.yaml for three Kinect v2 around a table.

    They are at the corners of an equilateral triangle, RIG_DISTANCE_M from a point just above
    the middle of the table, and look down at it by RIG_TILT_DEG.
    """
    out = {}
    tilt = np.radians(RIG_TILT_DEG)
    for i, name in enumerate(RIG):
        around = np.radians(90.0 + 120.0 * i)
        back = np.array([np.cos(around) * np.cos(tilt), np.sin(around) * np.cos(tilt),
                         np.sin(tilt)])
        right = np.cross((0.0, 0.0, 1.0), back)
        right /= np.linalg.norm(right)
        # Optical axes: x right, y down, z forward.
        R_world_camera = np.column_stack([right, np.cross(-back, right), -back])
        position = RIG_DISTANCE_M * back + (0.0, 0.0, 0.03)
        quaternion = Rotation.from_matrix(R_world_camera).as_quat(canonical=True)
        out[name] = {
            'width': WIDTH, 'height': HEIGHT, 'distortion_model': 'plumb_bob',
            'K': list(K), 'D': list(D),
            'world_from_camera': {'translation': np.round(position, 6).tolist(),
                                  'rotation_xyzw': np.round(quaternion, 9).tolist()}}
    return out


def write_catalogue(folder: str | Path, name: str, meshes: Mapping[str, trimesh.Trimesh]) -> Path:
    """Write a `hooc-scenes/1` folder of named meshes without scenes; return its path."""
    folder = Path(folder)
    (folder / 'models').mkdir(parents=True, exist_ok=True)
    for category, mesh in meshes.items():
        mesh.export(folder / 'models' / f'{category}.ply')
    dataset = {'format': 'hooc-scenes/1', 'name': name, 'world_frame': 'table',
               'depth_unit': 0.001, 'cameras': list(RIG), 'max_instances_per_category': 1,
               'categories': [{'name': c, 'model': f'models/{c}.ply'} for c in meshes]}
    for file, data in (('dataset.yaml', dataset), ('cameras.yaml', default_cameras())):
        text = yaml.safe_dump(data, sort_keys=False, default_flow_style=None)
        (folder / file).write_text(text, encoding='utf-8')
    return folder

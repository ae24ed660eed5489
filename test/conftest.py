# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Fixtures for all tests."""

import importlib.util
import os
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parent.parent


def pytest_collection_modifyitems(items):
    """Put the files with slow tests first: where files run side by side, none is waited for."""
    slow = {item.path for item in items
            if any(item.get_closest_marker(name) for name in ('slow', 'colcon'))}
    items.sort(key=lambda item: item.path not in slow)


@pytest.fixture(scope='session')
def repository():
    """Return the root of the source tree."""
    return REPOSITORY


@pytest.fixture(scope='session')
def shared_scenes():
    """Return the folder of recorded scene sets beside the repository; skip where absent."""
    path = Path(os.environ.get('HOOC_SHARED_SCENES', REPOSITORY.parent / 'shared' / 'scenes'))
    if not path.is_dir():
        pytest.skip('no recorded scenes beside the repository (../shared/scenes)')
    return path


@pytest.fixture(scope='session')
def tabletop():
    """Return the module of rendered tables with boxes and cylinders (tabletop.py)."""
    spec = importlib.util.spec_from_file_location('tabletop', Path(__file__).with_name(
        'tabletop.py'))
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


# Two links that turn about vertical axes 0.3 m above the table, and a gripper.
ARM = """
<robot name="arm">
  <link name="base_link">
    <visual><origin xyz="0 0 0.15"/><geometry><cylinder radius="0.05" length="0.3"/></geometry>
    </visual>
  </link>
  <link name="upper">
    <visual><origin xyz="0.15 0 0"/><geometry><box size="0.3 0.06 0.06"/></geometry></visual>
  </link>
  <link name="lower">
    <visual><origin xyz="0.125 0 0" rpy="0 1.5707963 0"/>
      <geometry><cylinder radius="0.03" length="0.25"/></geometry></visual>
  </link>
  <link name="tool">
    <visual><geometry><sphere radius="0.04"/></geometry></visual>
  </link>
  <link name="flange"/>
  <joint name="shoulder" type="continuous">
    <parent link="base_link"/><child link="upper"/><origin xyz="0 0 0.3"/><axis xyz="0 0 1"/>
  </joint>
  <joint name="elbow" type="revolute">
    <parent link="upper"/><child link="lower"/><origin xyz="0.3 0 0"/><axis xyz="0 0 1"/>
    <limit lower="-2" upper="2" effort="1" velocity="1"/>
  </joint>
  <joint name="wrist" type="fixed">
    <parent link="lower"/><child link="flange"/><origin xyz="0.25 0 0"/>
  </joint>
  <joint name="slide" type="prismatic">
    <parent link="flange"/><child link="tool"/><axis xyz="1 0 0"/>
    <mimic joint="elbow" multiplier="0.1" offset="0.02"/>
    <limit lower="0" upper="1" effort="1" velocity="1"/>
  </joint>
</robot>
"""


@pytest.fixture(scope='session')
def arm_urdf():
    """Return the URDF of an arm: joints shoulder and elbow; links base_link to tool."""
    return ARM

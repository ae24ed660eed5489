# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The residual of a pair of cameras is the motion that was made up, or is not measured."""

from hooc_perception.core.extrinsics.residual import pair_residuals
from hooc_perception.core.segment.observe import observe
from hooc_perception.core.segment.rectify import rectify
from hooc_perception.core.types import DepthView
import numpy as np
import pytest
from scipy.spatial.transform import Rotation


def residual(views):
    found, = pair_residuals(observe([rectify(view) for view in views]))
    return found


def moved_on_table(tabletop, camera, shift, turn_deg):
    """Return a Camera whose stated pose is shifted and turned about the vertical axis."""
    T = np.eye(4)
    T[:3, :3] = Rotation.from_rotvec([0, 0, np.radians(turn_deg)]).as_matrix()
    T[:2, 3] = shift
    return tabletop.replace(camera, T_world_camera=T @ camera.T_world_camera)


@pytest.fixture(scope='module')
def pair(tabletop):
    return tabletop.camera('left', 20), tabletop.camera('right', 75)


def test_true_poses_agree(tabletop, pair):
    views, = tabletop.scenes(pair, pair, [3])
    found = residual(views)
    assert found.names == ('left', 'right') and found.place_known and found.trouble is None
    assert found.shift_m < 0.003 and found.turn_deg < 0.4
    assert found.agreement > 0.8 and found.points > 500


@pytest.mark.parametrize('shift, turn_deg', [((0.02, 0), 0), ((0, -0.025), 0), ((0, 0), 2.5),
                                             ((0.015, 0.015), -2)])
def test_a_wrong_pose_is_measured(tabletop, pair, shift, turn_deg):
    stated = pair[0], moved_on_table(tabletop, pair[1], shift, turn_deg)
    views, = tabletop.scenes(pair, stated, [3])
    found = residual(views)
    # The surfaces turn about the origin, hence their middle moves by the shift and a little more.
    assert found.shift_m == pytest.approx(np.hypot(*shift), abs=0.005)
    assert found.turn_deg == pytest.approx(abs(turn_deg), abs=0.5)
    assert 'left and right' in found.trouble and 'hooc calibrate' in found.trouble
    assert f'{1000 * found.shift_m:.0f} mm' in found.trouble


def test_a_bare_table_says_nothing_of_place_and_heading(tabletop, pair):
    stated = pair[0], moved_on_table(tabletop, pair[1], (0.04, 0.0), 0)
    views, = tabletop.scenes(pair, stated, [3], count=0)
    found = residual(views)
    assert not found.place_known and 'height and tilt only' in str(found)
    assert found.shift_m < 0.003


def test_a_lone_cylinder_leaves_the_heading_open(tabletop, pair):
    views, = tabletop.scenes(pair, pair, [3], count=1)
    assert not residual(views).place_known


def test_cameras_that_see_different_places_are_not_measured(tabletop, pair):
    left, right = tabletop.scenes(pair, pair, [3])[0]
    columns = np.arange(left.depth.shape[1])
    halves = [DepthView(left.camera, np.where(columns < 60, left.depth, np.nan)),
              DepthView(right.camera, np.where(columns >= 260, right.depth, np.nan))]
    found = residual(halves)
    assert np.isnan(found.shift_m) and np.isnan(found.turn_deg) and found.trouble is None
    assert 'not measured' in str(found)


def test_a_camera_that_dropped_out_is_in_no_pair(tabletop, pair):
    left, right = tabletop.scenes(pair, pair, [3])[0]
    blind = DepthView(right.camera, np.full_like(right.depth, np.nan))
    assert pair_residuals(observe([rectify(left), rectify(blind)])) == []


def test_a_camera_that_was_knocked_over_is_noticed(tabletop, pair):
    stated = pair[0], moved_on_table(tabletop, pair[1], (0.15, 0.1), 20)
    views, = tabletop.scenes(pair, stated, [3])
    found = residual(views)
    assert found.trouble is not None and 'hooc calibrate' in found.trouble


def test_it_is_the_same_again(tabletop, pair):
    views, = tabletop.scenes(pair, pair, [3])
    assert residual(views) == residual(views)

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""A table that is found and tracked in the frame of a robot."""

from dataclasses import replace

from hooc_perception.core.geometry import inverse, transform
from hooc_perception.core.segment.config import ObserveConfig
from hooc_perception.core.segment.observe import observe
from hooc_perception.core.segment.rectify import rectify
from hooc_perception.core.segment.table import locate_table, TableTracker
from hooc_perception.errors import HoocError
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

FIND = ObserveConfig(table='find')


def base_link(height=0.72, tilt=0.03, turn=0.8, at=(0.6, -0.1)):
    """Return T_target_world: where the table of the scene is in the frame of a robot."""
    T = np.eye(4)
    T[:3, :3] = (Rotation.from_rotvec([tilt, 0, 0]) * Rotation.from_euler('z', turn)).as_matrix()
    T[:3, 3] = [*at, height]
    return T


def moved(desk, T, noise_m=0.001):
    """Return the RectifiedViews of the desk with cameras posed in another frame."""
    rng = np.random.default_rng(0)
    out = []
    for view in map(rectify, desk.views):
        depth = view.depth + noise_m * rng.standard_normal(view.depth.shape).astype(np.float32)
        out.append(replace(view, depth=depth.astype(np.float32), camera=replace(
            view.camera, T_world_camera=T @ view.camera.T_world_camera)))
    return out


def errors(table, T):
    """Return (distance of its plane in metres, angle in rad) from the true one."""
    n, m = table.T[:3, 2], T[:3, 2]
    return (abs((table.T[:3, 3] - T[:3, 3]) @ m),
            np.arccos(np.clip(n @ m, -1, 1)))


@pytest.mark.parametrize('T', [base_link(), base_link(-0.3, 0.1, 2.0),
                               base_link(0.0, 0.0, 0.0, (0, 0))])
def test_height_and_tilt_are_found(desk, T):
    table = locate_table(moved(desk, T), FIND)
    away, angle = errors(table, T)
    assert away < 0.002 and angle < 0.004
    assert table.residual_m < 0.004 and len(table.outline) >= 3
    # What is reported is where the table really is.
    np.testing.assert_allclose(transform(inverse(T), table.corners)[:, 2], 0, atol=0.005)


def test_a_frame_that_is_not_upright_needs_no_bounds(desk):
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = Rotation.from_rotvec([1.9, 0.4, 0.2]).as_matrix(), [0, 0.2, 1.1]
    away, angle = errors(locate_table(moved(desk, T), replace(FIND, table_tilt_deg=180.0)), T)
    assert away < 0.002 and angle < 0.004
    with pytest.raises(HoocError, match='no table is found between z = -0.5 m and 1.5 m'):
        locate_table(moved(desk, T), FIND)


def test_the_same_objects_stand_out_in_any_frame(desk):
    T = base_link()
    views = moved(desk, T)
    observation = observe(views, FIND, locate_table(views, FIND).T_target_table)
    there = observation.in_target_frame().views
    for a, b, c in zip(observe(moved(desk, np.eye(4))).views, observation.views, there,
                       strict=True):
        # The edge of the workspace and pixels at the threshold of height differ.
        assert (a.foreground & b.foreground).sum() > 0.97 * (a.foreground | b.foreground).sum()
        np.testing.assert_allclose(c.camera.T_world_camera,
                                   T @ a.camera.T_world_camera, atol=0.006)


def test_bounds_exclude_what_is_no_table(desk):
    T = base_link(height=0.4)
    with pytest.raises(HoocError, match='between z = 0.6 m and 1 m'):
        locate_table(moved(desk, T), replace(FIND, table_low_m=0.6, table_high_m=1.0))
    with pytest.raises(HoocError, match='at most 1 degrees'):
        locate_table(moved(desk, T), replace(FIND, table_tilt_deg=1.0))


def test_a_table_at_rest_is_kept_to_the_bit_and_one_that_moves_is_followed(desk):
    tracker, T = TableTracker(), base_link()
    first = tracker.update(moved(desk, T), FIND)
    assert tracker.update(moved(desk, T, 0.002), FIND) is first
    for lifted in (0.01, 0.02, 0.03, 0.04):
        T[2, 3] = 0.72 + lifted
        table = tracker.update(moved(desk, T), FIND)
        assert errors(table, T)[0] < 0.003
    # Lifted at once by more than its surroundings tell: it is looked for anew.
    T[2, 3] += 0.3
    assert errors(tracker.update(moved(desk, T), FIND), T)[0] < 0.002


def test_a_table_that_has_gone_is_no_longer_claimed(desk):
    tracker = TableTracker()
    tracker.update(moved(desk, base_link()), FIND)
    rng = np.random.default_rng(1)
    nothing = [replace(view, depth=rng.uniform(0.4, 3, view.depth.shape).astype(np.float32))
               for view in moved(desk, base_link())]
    with pytest.raises(HoocError, match='no table is found'):
        tracker.update(nothing, FIND)
    tracker.update(moved(desk, base_link()), FIND)      # it is back


def test_the_workspace_is_in_the_target_frame(desk):
    T = base_link(tilt=0.0, turn=0.0)
    views = moved(desk, T)
    half = replace(FIND, workspace='[[0.6, -0.6], [1.2, 0.4]]')
    table = locate_table(views, half)
    np.testing.assert_allclose(table.T[:2, 3], [0.9, -0.1])
    whole = observe(views, FIND, locate_table(views, FIND).T_target_table)
    right = observe(views, half, table.T_target_table)
    left = observe(views, replace(FIND, ignore='[[[0.6, -0.6], [1.2, 0.4]]]'),
                   locate_table(views, FIND).T_target_table)
    n, a, b = (sum(int(v.foreground.sum()) for v in o.views) for o in (whole, right, left))
    assert a > 200 and b > 200 and a + b == pytest.approx(n, rel=0.02)


def test_a_given_table_may_have_a_workspace_away_from_the_origin(desk):
    T = base_link(height=0.0, tilt=0.0, turn=0.3, at=(0.9, 0.4))
    views = moved(desk, T)
    config = ObserveConfig(workspace='[[0.3, -0.2], [1.5, 1.0]]')
    seen = observe(views, config, locate_table(views, config).T_target_table)
    near = observe(moved(desk, np.eye(4)))
    for a, b in zip(near.views, seen.views, strict=True):
        assert (a.foreground & b.foreground).sum() > 0.95 * (a.foreground | b.foreground).sum()


def test_a_workspace_in_millimetres_is_refused(desk):
    with pytest.raises(HoocError, match='reaches .* from its middle, more than 3 m'):
        observe(moved(desk, np.eye(4)), ObserveConfig(workspace='[[-400, -300], [400, 300]]'))

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Observation: the level of the table, what stands on it, and what is refused."""

from dataclasses import replace

from hooc_perception.core.geometry import canonical_pose, inverse, rays
from hooc_perception.core.segment.config import ObserveConfig
from hooc_perception.core.segment.foreground import observed_view
from hooc_perception.core.segment.observe import observe
from hooc_perception.core.segment.rectify import rectify
from hooc_perception.core.types import DepthView, RectifiedView
from hooc_perception.errors import HoocError
import numpy as np
import pytest
from scipy.spatial.transform import Rotation


def rectified(desk):
    """Return the desk's RectifiedViews."""
    return [rectify(v) for v in desk.views]


def tilted(view, rotvec, z):
    """Return a view whose calibration is wrong by a small rotation and height."""
    T = np.eye(4)
    T[:3, :3], T[2, 3] = Rotation.from_rotvec(rotvec).as_matrix(), z
    return replace(view, camera=replace(view.camera,
                                        T_world_camera=T @ view.camera.T_world_camera))


def level_error(camera, true_camera):
    """Return (angle rad, height m) by which a camera's idea of the table is off."""
    T = camera.T_world_camera @ inverse(true_camera.T_world_camera)
    return np.arccos(min(1.0, T[2, 2])), abs(T[2, 3])


@pytest.mark.parametrize('rotvec, z', [([0.012, 0, 0], 0.0), ([0, 0, 0], 0.006),
                                       ([-0.006, 0.01, 0.0], -0.005)])
def test_a_small_tilt_and_offset_are_taken_back(desk, rotvec, z):
    wrong = [tilted(v, rotvec, z) for v in rectified(desk)]
    for view, before, true in zip(observe(wrong).views, wrong, desk.cameras, strict=True):
        angle_before, z_before = level_error(before.camera, true)
        angle, height = level_error(view.camera, true)
        assert angle < 0.002 + 0.1 * angle_before
        assert height < 0.0006 + 0.1 * z_before


def test_only_the_level_is_touched(desk):
    # Heading and place on the table cannot be seen in a plane: they stay.
    for view, true in zip(observe([tilted(v, [0.01, 0, 0], 0.004) for v in rectified(desk)]).views,
                          desk.cameras, strict=True):
        T = view.camera.T_world_camera @ inverse(true.T_world_camera)
        yaw = np.arctan2(T[1, 0] - T[0, 1], T[0, 0] + T[1, 1])
        assert abs(yaw) < 0.001
        assert np.linalg.norm(T[:2, 3]) < 0.001


def test_a_large_offset_is_not_trusted(desk):
    config = ObserveConfig(max_correction_m=0.004)
    wrong = [tilted(v, [0, 0, 0], 0.01) for v in rectified(desk)]
    for view, before in zip(observe(wrong, config).views, wrong, strict=True):
        np.testing.assert_array_equal(view.camera.T_world_camera, before.camera.T_world_camera)


def test_a_low_board_does_not_lift_the_table(small, desk):
    board = small.box([0.05, 0.0, 0.005], [0.2, 0.2, 0.01])
    views, ids = small.views_of([board], desk.cameras)
    for view, index, true in zip(observe(views).views, ids, desk.cameras, strict=True):
        angle, height = level_error(view.camera, true)
        assert angle < 0.001
        assert height < 0.0005
        top = (index == 0) & view.foreground
        assert top.sum() > 0.9 * (index == 0).sum()


def test_foreground_is_what_stands_there(desk):
    for view, classes, clean in zip(desk.observation.views, desk.classes, desk.clean,
                                    strict=True):
        T = view.camera.T_world_camera
        height = (rays(view.camera.K, *clean.shape) @ T[2, :3]) * clean + T[2, 3]
        thing = (classes > 0) & (height > 0.01) & np.isfinite(view.depth)
        assert thing.sum() > 1000
        assert view.foreground[thing].mean() > 0.995
        assert not view.foreground[classes == 0].any()
        assert not view.foreground[~np.isfinite(view.depth)].any()


def test_an_empty_table_has_no_foreground_and_a_known_background(empty_desk):
    for view, clean in zip(empty_desk.observation.views, empty_desk.clean, strict=True):
        assert not view.foreground.any()
        on_table = view.table & np.isfinite(clean)
        assert on_table.mean() > 0.5
        np.testing.assert_allclose(view.background[on_table], clean[on_table], atol=0.002)
    assert 0.0005 <= empty_desk.observation.noise_m < 0.002


def test_the_background_under_an_object_is_the_table(desk, empty_desk):
    for view, classes, clean in zip(desk.observation.views, desk.classes, empty_desk.clean,
                                    strict=True):
        covered = (classes > 0) & view.table
        np.testing.assert_allclose(view.background[covered], clean[covered], atol=0.003)


def test_beyond_the_edge_of_the_table_the_background_is_what_was_measured(desk):
    camera = desk.cameras[0]
    T = camera.T_world_camera
    directions = rays(camera.K, camera.height, camera.width) @ T[:3, :3].T
    table, floor = (-T[2, 3] / directions[..., 2], (-0.7 - T[2, 3]) / directions[..., 2])
    hit = directions * table[..., None] + T[:3, 3]
    on_table = np.abs(hit[..., :2]).max(-1) < 0.15
    depth = np.where(on_table, table, floor).astype(np.float32)
    view, = observe([RectifiedView(camera, depth)]).views
    assert 0.1 < on_table.mean() < 0.7
    assert (view.table == on_table).mean() > 0.99
    np.testing.assert_allclose(view.background, depth, atol=0.001)
    assert not view.foreground.any()


def test_specks_and_far_and_high_things_are_no_objects(empty_desk, small):
    camera = empty_desk.cameras[0]
    speck = np.array(rectified(empty_desk)[0].depth)
    speck[40:42, 60:62] -= 0.1
    view, = observe([RectifiedView(camera, speck)]).views
    assert not view.foreground.any()
    things = [small.box([0.0, 0, 0.05], [0.05, 0.05, 0.1]),
              small.box([0.15, 0.1, 0.05], [0.06, 0.06, 0.06])]
    views, ids = small.views_of(things, empty_desk.cameras[:1])
    near, = observe(views, ObserveConfig(workspace_radius_m=0.1)).views
    assert near.foreground[ids[0] == 0].any()
    assert not near.foreground[ids[0] == 1].any()
    low, = observe(views, ObserveConfig(max_height_m=0.06)).views
    T = camera.T_world_camera
    height = rays(camera.K, *low.depth.shape) @ T[2, :3] * low.depth + T[2, 3]
    assert height[low.foreground].max() < 0.062


def test_the_same_images_give_the_same_observation_and_stay_as_they_are(desk):
    views = rectified(desk)
    copies = [v.depth.copy() for v in views]
    for a, b in zip(observe(views).views, observe(views).views, strict=True):
        for name in ('depth', 'background', 'foreground', 'table'):
            np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
        np.testing.assert_array_equal(a.camera.T_world_camera, b.camera.T_world_camera)
    for view, copy in zip(views, copies, strict=True):
        np.testing.assert_array_equal(view.depth, copy)


def test_the_rectified_pose_survives_a_quaternion(desk):
    for raw, view in zip(desk.views, rectified(desk), strict=True):
        np.testing.assert_array_equal(view.camera.T_world_camera,
                                      canonical_pose(raw.camera.T_world_camera))


def test_a_camera_without_a_reading_changes_nothing_for_the_others(desk):
    views = rectified(desk)
    before = observe([views[0], views[2]])
    views[1] = replace(views[1], depth=np.full_like(views[1].depth, np.nan))
    after = observe(views)
    assert after.noise_m == before.noise_m and not after.views[1].foreground.any()
    for i, k in ((0, 0), (1, 2)):
        np.testing.assert_array_equal(after.views[k].foreground, before.views[i].foreground)
        np.testing.assert_array_equal(after.views[k].background, before.views[i].background)


def test_images_without_a_reading_are_refused_by_their_cameras_name(desk):
    views = [replace(view, depth=np.full_like(view.depth, np.nan)) for view in rectified(desk)]
    with pytest.raises(HoocError, match='camera0 holds no reading'):
        observe(views)
    zeros = DepthView(desk.cameras[2], np.zeros((120, 160), np.float32))
    with pytest.raises(HoocError, match='camera2 holds no reading'):
        observe([rectify(zeros)])


def test_no_camera_at_all_is_refused():
    with pytest.raises(HoocError, match='at least one camera'):
        observe([])


def test_a_view_with_hardly_any_table_keeps_its_pose(desk):
    # Only the objects were measured: nothing says where the table is.
    views = [replace(v, depth=np.where(c > 0, v.depth, np.nan).astype(np.float32))
             for v, c in zip(rectified(desk), desk.classes, strict=True)]
    observation = observe(views, ObserveConfig(table_band_m=0.005))
    for view, before in zip(observation.views, views, strict=True):
        np.testing.assert_array_equal(view.camera.T_world_camera, before.camera.T_world_camera)
        assert view.foreground.sum() > 1000


@pytest.mark.parametrize('uneven_m', [0.0, 0.12])
def test_a_view_is_rebuilt_to_the_last_bit_from_depth_pose_and_masks(desk, uneven_m):
    views = [tilted(v, [0.006, -0.004, 0.01], 0.003) for v in rectified(desk)]
    for view in observe(views, ObserveConfig(uneven_m=uneven_m,
                                             workspace_radius_m=0.2)).views:
        # As another process has them: copies of the bytes, the masks packed to bits.
        T = np.frombuffer(view.camera.T_world_camera.tobytes()).reshape(4, 4).copy()
        masks = [np.unpackbits(np.packbits(mask), count=mask.size).reshape(mask.shape)
                 .astype(bool) for mask in (view.foreground, view.table)]
        again = observed_view(replace(view.camera, T_world_camera=T), view.depth.copy(), *masks)
        assert view.foreground.any() and np.isnan(view.background).any()
        assert 0.1 < view.table.mean() < 0.95
        for name in ('depth', 'background', 'foreground', 'table'):
            a, b = getattr(view, name), getattr(again, name)
            assert a.dtype == b.dtype and a.tobytes() == b.tobytes()
        assert again.camera.T_world_camera.tobytes() == view.camera.T_world_camera.tobytes()

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Calibration recovers disturbed poses, and refuses where the scenes do not determine them."""

from dataclasses import replace

from hooc_perception.calibration.calibrate import calibrate
from hooc_perception.core.geometry import inverse
from hooc_perception.errors import HoocError
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

SEEDS = (1, 2, 3, 4)


@pytest.fixture(scope='module')
def true(tabletop):
    return (tabletop.camera('left', 20), tabletop.camera('middle', 80),
            tabletop.camera('right', 140))


def wrong(tabletop, true, seed):
    """Return the Cameras with poses that are 5 degrees and 5 cm off."""
    rng = np.random.default_rng(seed)
    return tuple(tabletop.disturbed(camera, rng) for camera in true)


def heading(camera):
    """Return the angle (rad) of the optical axis on the table."""
    return np.arctan2(camera.T_world_camera[1, 2], camera.T_world_camera[0, 2])


@pytest.fixture(scope='module')
def case(tabletop, true):
    """Return (stated Cameras, Calibration) of disturbed cameras and several scenes."""
    stated = wrong(tabletop, true, 0)
    return stated, calibrate(tabletop.scenes(true, stated, SEEDS))


def test_it_recovers_the_poses_against_each_other(case, tabletop, true):
    stated, found = case
    for k in (1, 2):
        T_true = inverse(true[0].T_world_camera) @ true[k].T_world_camera
        T_found = inverse(found.cameras[0].T_world_camera) @ found.cameras[k].T_world_camera
        mm, deg = tabletop.pose_error(T_true, T_found)
        assert mm < 5 and deg < 0.3, (k, mm, deg)


def test_it_recovers_height_and_tilt(case, true):
    for camera, seen in zip(case[1].cameras, true):
        assert camera.T_world_camera[2, 3] == pytest.approx(seen.T_world_camera[2, 3], abs=0.003)
        up = camera.T_world_camera[2, :3] @ seen.T_world_camera[2, :3]
        assert np.degrees(np.arccos(min(up, 1.0))) < 0.25


def test_place_and_heading_of_the_first_camera_stay(case):
    stated, found = case
    assert found.cameras[0].T_world_camera[:2, 3] == pytest.approx(
        stated[0].T_world_camera[:2, 3], abs=1e-9)
    turned = heading(found.cameras[0]) - heading(stated[0])
    # Levelling turns about a horizontal axis, which moves the axis of a tilted camera a little.
    assert abs(np.degrees(turned)) < 5


def test_the_figures_are_held_out_and_say_what_was_wrong(case, tabletop, true):
    stated, found = case
    assert found.held_out and found.scenes == len(SEEDS)
    assert len(found.pairs) == 3
    assert all(a is b for a, b in zip(found.before, stated))
    for old, new in found.pairs:
        assert old.shift_m > 0.02 or old.turn_deg > 2
        assert new.shift_m < 0.005 and new.turn_deg < 0.5 and new.trouble is None
    for figures in found.figures:
        assert figures.table_after.mm < 1.5 and figures.table_after.deg < 0.2
    assert max(f.table_before.mm for f in found.figures) > 10
    assert all(f.spread.mm < 5 for f in found.figures[1:])


def test_the_same_scenes_give_the_same_poses(tabletop, true):
    stated = wrong(tabletop, true[:2], 0)
    twice = [calibrate(tabletop.scenes(true[:2], stated, SEEDS[:1])) for _ in range(2)]
    for a, b in zip(twice[0].cameras, twice[1].cameras):
        assert np.array_equal(a.T_world_camera, b.T_world_camera)
    assert twice[0].pairs == twice[1].pairs


def test_one_scene_has_no_held_out_figures(tabletop, true):
    found = calibrate(tabletop.scenes(true[:2], true[:2], [1]))
    assert not found.held_out and np.isnan(found.figures[1].spread.mm)
    assert 'not measured' in str(found.figures[1].spread)


def test_a_bare_table_is_refused(tabletop, true):
    with pytest.raises(HoocError) as error:
        calibrate(tabletop.scenes(true[:2], wrong(tabletop, true[:2], 0), SEEDS[:1], count=0))
    text = str(error.value)
    assert 'middle' in text and 'position along' in text and 'heading' in text
    assert 'put five or more objects' in text


def test_a_lone_cylinder_leaves_the_heading_open(tabletop, true):
    with pytest.raises(HoocError, match='heading') as error:
        calibrate(tabletop.scenes(true[:2], true[:2], SEEDS[:1], count=1))
    assert 'position' not in str(error.value)


def test_a_single_camera_is_levelled_and_stays_where_it_is(tabletop, true):
    stated = wrong(tabletop, true[:1], 3)
    found = calibrate(tabletop.scenes(true[:1], stated, SEEDS[:1]))
    T = found.cameras[0].T_world_camera
    assert T[:2, 3] == pytest.approx(stated[0].T_world_camera[:2, 3], abs=1e-9)
    assert T[2, 3] == pytest.approx(true[0].T_world_camera[2, 3], abs=0.003)
    assert np.degrees(np.arccos(T[2, :3] @ true[0].T_world_camera[2, :3])) < 0.25
    assert found.pairs == ()


def test_a_camera_whose_table_is_nowhere_near_is_named(tabletop, true):
    T = true[1].T_world_camera.copy()
    T[:3, :3] = Rotation.from_rotvec([0.5, 0, 0]).as_matrix() @ T[:3, :3]
    stated = true[0], replace(true[1], T_world_camera=T)
    with pytest.raises(HoocError, match='middle sees no table within'):
        calibrate(tabletop.scenes(true[:2], stated, SEEDS[:1]))


def test_a_camera_that_moved_between_the_scenes_is_noticed(tabletop, true):
    moved = true[0], tabletop.disturbed(true[1], np.random.default_rng(1), 1.5, 0.03)
    scenes = tabletop.scenes(true[:2], true[:2], SEEDS)
    elsewhere = tabletop.scenes(moved, true[:2], SEEDS)
    with pytest.raises(HoocError, match='two halves of the scenes give poses that differ by'):
        calibrate([scenes[0], elsewhere[1], scenes[2], elsewhere[3]])


def test_nothing_to_calibrate_from():
    with pytest.raises(HoocError, match='no frame set'):
        calibrate([])

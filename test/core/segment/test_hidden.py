# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Pixels on and behind the robot are set aside; what stands in front of it stays."""

from dataclasses import replace

from hooc_perception.core.geometry import transform
from hooc_perception.core.render import render_depth
from hooc_perception.core.segment.hidden import hidden_shares, robot_depth, without_robot
from hooc_perception.core.segment.observe import observe
from hooc_perception.core.segment.rectify import raw_pixels, rectify
from hooc_perception.core.types import Camera, DepthView
from hooc_perception.errors import HoocError
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

LENS = np.array([0.08, -0.2, 0.001, 0.002, 0.05])


def overhead(D=np.zeros(5)):
    """Return a camera 1 m above the table that looks straight down."""
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler('x', np.pi).as_matrix()
    T[2, 3] = 1.0
    return Camera('c', 160, 120, np.array([[150.0, 0, 79.5], [0, 150.0, 59.5], [0, 0, 1]]), D, T)


def seen(meshes, camera=None):
    """Return the DepthView of meshes over a table 1 m below."""
    camera = camera or overhead()
    depth, _ = render_depth(meshes, replace(camera, D=np.zeros(5)))
    return DepthView(camera, np.where(np.isfinite(depth), depth, 1.0).astype(np.float32))


@pytest.fixture
def bar(small):
    """Return a bar 0.3 m above the table, across the image along x."""
    return small.box([0, 0, 0.3], [2.0, 0.06, 0.06])


def test_the_robot_is_hidden_and_nothing_else(bar, small):
    cup = small.box([0.2, 0.25, 0.05], [0.08, 0.08, 0.1])
    view = seen([bar, cup])
    got = without_robot(view, [bar])
    on_bar = np.abs(view.depth - (1 - 0.33)) < 1e-3
    assert on_bar.sum() > 1000
    np.testing.assert_array_equal(got.hidden, on_bar)
    assert np.isnan(got.depth[on_bar]).all()
    np.testing.assert_array_equal(got.depth[~on_bar], view.depth[~on_bar])


def test_what_stands_in_front_of_the_robot_stays(bar, small):
    ball = small.box([0.1, 0, 0.6], [0.05, 0.05, 0.05])
    view = seen([bar, ball])
    got = without_robot(view, [bar])
    near = view.depth < 0.5
    assert near.sum() > 100 and not got.hidden[near].any()
    np.testing.assert_array_equal(got.depth[near], view.depth[near])


def test_pixels_without_a_reading_are_hidden_only_where_the_robot_is(bar):
    view = seen([bar])
    depth = view.depth.copy()
    depth[58:62, :80] = np.nan      # on the bar
    depth[5:9, :80] = np.nan        # on the table
    got = without_robot(replace(view, depth=depth), [bar])
    assert got.hidden[58:62, :80].all() and not got.hidden[5:9, :80].any()


def test_padding_in_pixels_moves_the_outline(bar):
    view = seen([bar])
    rows = [without_robot(view, [bar], px).hidden[:, 80].sum() for px in (0, 1, 3)]
    assert [rows[1] - rows[0], rows[2] - rows[0]] == [2, 6]


def test_the_lens_bends_the_mask(bar):
    """Rectified, the raw mask is the mask of the rectified image, with no pixel left over."""
    camera = overhead(LENS)
    flat = seen([bar]).depth
    source = raw_pixels(camera)
    raw = np.full(flat.size, 1.0, np.float32)
    raw[source[source >= 0]] = flat[source >= 0]
    view = DepthView(camera, raw.reshape(flat.shape))
    got = rectify(without_robot(view, [bar]))
    robot = np.isfinite(robot_depth([bar], got.camera)) & (source >= 0)
    assert robot.sum() > 1000 and got.hidden[robot].all()
    # A raw pixel that two rectified ones share is hidden in both.
    assert got.hidden.sum() < 1.05 * robot.sum()
    assert np.isnan(got.depth[got.hidden]).all()


def test_links_that_reach_behind_the_camera_are_cut_not_dropped():
    """A box of twelve large triangles from in front of the camera to behind it."""
    from hooc_perception.core.segment.hidden import _cut_near, NEAREST_M
    camera = overhead()
    corners = np.array([[x, y, z] for x in (-.05, .05) for y in (-.05, .05) for z in (.2, 1.5)])
    corners[:, 0] += 0.15
    faces = np.array([[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7],
                      [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]], np.int32)
    depth = robot_depth([(corners, faces)], camera)
    assert np.isfinite(depth).sum() > 1000
    assert depth.min() > NEAREST_M - 1e-6
    # The side of the box towards the optical axis: at pixel u it is 0.1 m / ((u - cx) / f) deep.
    u = 120
    assert depth[60, u] == pytest.approx(0.1 * 150 / (u - 79.5), abs=1e-3)
    vertices, kept = _cut_near((corners, faces), camera)
    area = np.linalg.norm(np.cross(vertices[kept[:, 1]] - vertices[kept[:, 0]],
                                   vertices[kept[:, 2]] - vertices[kept[:, 0]]), axis=1).sum() / 2
    # Four sides from z = 0.2 up to 0.1 m below the camera, and the bottom.
    assert area == pytest.approx(4 * 0.1 * (1 - NEAREST_M - 0.2) + 0.01)


def test_a_camera_inside_of_its_housing_sees_out(small):
    housing = small.box([0, 0, 1.0], [0.1, 0.1, 0.1])
    view = seen([])
    assert without_robot(view, [housing]) is view


def test_hidden_is_neither_object_nor_free_space(bar, small):
    cup = small.box([0.0, 0.0, 0.05], [0.08, 0.08, 0.1])
    camera = overhead()
    view = seen([bar, cup], camera)
    before, after = observe([rectify(view)]), observe([rectify(without_robot(view, [bar]))])
    assert before.views[0].foreground.any(), 'the bar was an object'
    mask = after.views[0].hidden
    assert not after.views[0].foreground[mask].any()
    assert np.isnan(after.views[0].depth[mask]).all()
    np.testing.assert_array_equal(after.views[0].foreground[~mask],
                                  before.views[0].foreground[~mask])


def test_the_hidden_share_of_the_table(bar):
    view = seen([bar])
    observation = observe([rectify(without_robot(view, [bar])), rectify(seen([]))])
    mine = observation.views[0]
    share, none = hidden_shares(observation)
    assert share == pytest.approx((mine.hidden & mine.table).sum() / mine.table.sum())
    assert 0.05 < share < 0.4 and none == 0.0


def test_a_robot_that_hides_everything_is_named(small):
    view = without_robot(seen([]), [small.box([0, 0, 0.5], [5, 5, 0.1])])
    assert view.hidden.all()
    with pytest.raises(HoocError, match='the robot hides every reading'):
        observe([rectify(view)])


def test_the_robot_of_a_urdf_is_masked_from_every_camera(arm_urdf, small):
    pytest.importorskip('yourdfpy')
    from hooc_perception.robot.description import RobotDescription
    from hooc_perception.robot.padding import padded
    arm = RobotDescription(arm_urdf)
    poses = arm.link_poses({'shoulder': 0.4, 'elbow': 0.5})
    T = np.eye(4)
    T[:3, 3] = -0.4, -0.1, 0.0
    links = {name: [(transform(T @ poses[name], vertices), faces)
                    for vertices, faces in padded(shape, 0.02)]
             for name, shape in arm.shapes.items()}
    bare = [(transform(T @ poses[name], np.asarray(s.vertices)), np.asarray(s.faces, np.int32))
            for name, s in arm.shapes.items()]
    cup = small.box([0.05, 0.3, 0.05], [0.08, 0.08, 0.1])
    for camera in small.rig(3):
        depth, ids = render_depth([*bare, cup], camera)
        noisy = depth + np.random.default_rng(0).normal(0, 0.005, depth.shape)
        view = DepthView(camera, np.where(np.isfinite(depth), noisy, 1.5).astype(np.float32))
        got = without_robot(view, [mesh for meshes in links.values() for mesh in meshes], 1)
        robot = (ids >= 0) & (ids < len(bare))
        assert robot.sum() > 500
        assert got.hidden[robot].all()
        # Padding of 2 cm and a pixel: a rim, not half of the image.
        assert got.hidden.sum() < 2.5 * robot.sum()

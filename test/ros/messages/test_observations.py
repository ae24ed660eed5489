# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""An observation passes the topics to the last bit; foreign and damaged messages are rejected."""

from dataclasses import replace

from hooc_perception.core.segment.config import ObserveConfig
from hooc_perception.core.segment.observe import observe
from hooc_perception.core.types import Camera, Observation, ObservedView, RectifiedView
from hooc_perception.errors import HoocError
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

pytest.importorskip('rclpy')

from hooc_perception.ros.messages import observations as o
from hooc_perception.ros.messages.conversions import (
    camera_info_message,
    depth_message,
    header,
    image_message,
)
from hooc_perception.ros.messages.point_clouds import cloud_message, cloud_rows
from rclpy.serialization import deserialize_message, serialize_message  # noqa: E402

HEAD = header(9, 'table')


def sent(message):
    return deserialize_message(serialize_message(message), type(message))


def a_view(name, seed, size=(120, 90), tilt=0.02):
    """Return a RectifiedView of a noisy table with a block on it, its pose slightly wrong."""
    rng, (w, h) = np.random.default_rng(seed), size
    K = np.array([[95.3, 0, w / 2 - 0.7], [0, 94.9, h / 2 + 0.3], [0, 0, 1]])
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler('xyz', [np.pi - 0.3 + tilt, 0.05, 0.7 * seed]).as_matrix()
    T[:3, 3] = T[:3, :3] @ [0, 0, -1.0] + [0.01, -0.02, 0.004]
    u, v = np.meshgrid(np.arange(w), np.arange(h))
    rays = np.stack([(u - K[0, 2]) / K[0, 0], (v - K[1, 2]) / K[1, 1], np.ones((h, w))], -1)
    true = T.copy()
    true[:3, :3] = Rotation.from_euler('x', -tilt / 4).as_matrix() @ T[:3, :3]
    depth = -true[2, 3] / (rays @ true[:3, :3].T)[..., 2] + rng.normal(0, 0.001, (h, w))
    depth[40:55, 50:70] -= 0.08
    depth[rng.random((h, w)) < 0.05] = np.nan
    return RectifiedView(Camera(name, w, h, K, np.zeros(5), T), depth.astype(np.float32))


def blind(view):
    return replace(view, depth=np.full_like(view.depth, np.nan))


def messages_of(observation):
    """Return ({camera: ViewMessages}, poses), as they arrive."""
    views = {view.camera.name: o.ViewMessages(
        sent(camera_info_message(view.camera, HEAD)), sent(depth_message(view.depth, HEAD)),
        sent(o.segments_message(view, HEAD))) for view in observation.views}
    return views, sent(o.poses_message(observation, HEAD))


def same_bits(a, b):
    """Compare records, arrays and numbers to the last bit."""
    if isinstance(a, np.ndarray):
        assert a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()
    elif isinstance(a, (Observation, ObservedView, Camera)):
        for name in a.__dataclass_fields__:
            same_bits(getattr(a, name), getattr(b, name))
    elif isinstance(a, tuple):
        assert len(a) == len(b)
        for x, y in zip(a, b):
            same_bits(x, y)
    else:
        assert type(a) is type(b) and a == b


@pytest.mark.parametrize('views', [
    [a_view('a', 1)], [a_view('a', 1), a_view('b', 2, (64, 48)), a_view('c', 3)],
    [a_view('a', 1), blind(a_view('b', 2))]])
def test_observations_pass_unchanged(views):
    observation = observe(views)
    first = observation.views[0]
    assert first.foreground.any() and first.table.any()
    assert (first.camera.T_world_camera != views[0].camera.T_world_camera).any(), 'levelled'
    same_bits(o.observation_from_messages(*messages_of(observation)), observation)


def test_the_example_of_the_bundled_scene(request):
    from hooc_perception.core.segment.rectify import rectify
    from hooc_perception.io.bags.reader import BagScene
    bag = request.config.rootpath / 'bags' / 'demo'
    if not (bag / 'metadata.yaml').is_file():
        pytest.skip('no bundled scene: make it with "make bundle"')
    observation = observe([rectify(view) for view in BagScene(bag).views()])
    same_bits(o.observation_from_messages(*messages_of(observation)), observation)


def half_hidden(view):
    """Return a view whose left half the robot hides."""
    hidden = np.zeros(view.depth.shape, bool)
    hidden[:, :hidden.shape[1] // 2] = True
    return replace(view, depth=np.where(hidden, np.float32(np.nan), view.depth), hidden=hidden)


def test_what_the_robot_hides_passes_unchanged():
    observation = observe([half_hidden(a_view('a', 1)), a_view('b', 2)])
    again = o.observation_from_messages(*messages_of(observation))
    same_bits(again, observation)
    assert again.views[0].hidden[:, :60].all() and not again.views[0].hidden[:, 60:].any()
    assert again.views[1].hidden is None


def test_hidden_pixels_have_no_reading():
    observation = observe([half_hidden(a_view('a', 1))])
    views, poses = messages_of(observation)
    wrong = replace(views['a'], depth=depth_message(a_view('a', 1).depth, HEAD))
    with pytest.raises(HoocError, match='hidden pixels with one'):
        o.observation_from_messages({'a': wrong}, poses)


def test_segments_are_bits_of_an_image():
    view = observe([a_view('a', 1)]).views[0]
    message = o.segments_message(view, HEAD)
    assert message.encoding == 'mono8' and (message.width, message.height) == (120, 90)
    pixels = np.frombuffer(bytes(message.data), np.uint8).reshape(90, 120)
    np.testing.assert_array_equal(pixels, view.foreground * 1 + view.table * 2)


def test_poses_are_a_table_of_float64():
    observation = observe([a_view('a', 1), a_view('b', 2)])
    rows = cloud_rows(o.poses_message(observation, HEAD))
    assert rows['noise_m'].tolist() == [observation.noise_m] * 2
    for row, view in zip(rows, observation.views):
        T = view.camera.T_world_camera
        assert [row['x'], row['y'], row['z']] == T[:3, 3].tolist()
        assert row['r12'] == T[1, 2] and row['r20'] == T[2, 0]


def test_a_table_elsewhere_in_the_target_frame():
    views, T = [a_view('a', 1), a_view('b', 3)], np.eye(4)
    T[:3, :3] = Rotation.from_rotvec([0.1, -0.2, 0.9]).as_matrix()
    T[:3, 3] = 0.6, -0.1, 0.72
    posed = [replace(view, camera=replace(view.camera, T_world_camera=T
                                          @ view.camera.T_world_camera)) for view in views]
    observation = observe(posed, ObserveConfig(), T)
    again = o.observation_from_messages(*messages_of(observation))
    assert again.T_target_table.tobytes() == T.tobytes()
    for before, after in zip(observation.views, again.views, strict=True):
        np.testing.assert_allclose(after.camera.T_world_camera, before.camera.T_world_camera,
                                   rtol=0, atol=1e-14)
        np.testing.assert_array_equal(after.foreground, before.foreground)
        assert before.foreground.any()
    # Where the cameras are is told in the target frame, and recordings without a table are read.
    poses = o.poses_message(observation, HEAD)
    rows = cloud_rows(poses)
    np.testing.assert_allclose(rows['z'], [view.camera.T_world_camera[2, 3] for view in
                                           observation.in_target_frame().views])
    old = observe(views)
    old_views, poses = messages_of(old)
    earlier = columns_of(poses, [(n, 'f8') for n in NAMES])
    same_bits(o.observation_from_messages(old_views, earlier), old)


def changed(poses, **columns):
    """Return the message of poses with other values in some columns of the last row."""
    rows = cloud_rows(poses).copy()
    for name, value in columns.items():
        rows[name][-1] = value
    return cloud_message(rows, HEAD)


def columns_of(poses, kinds):
    """Return the message of poses with only some columns, of other types."""
    rows = cloud_rows(poses)
    other = np.zeros(len(rows), np.dtype([(name, kind) for name, kind in kinds]))
    for name in other.dtype.names:
        other[name] = rows[name]
    return cloud_message(other, HEAD)


NAMES = (*o.POSE_COLUMNS, o.NOISE_COLUMN)


@pytest.mark.parametrize('flaw, word', [
    (lambda p: changed(p, x=np.nan), 'no rigid pose for b'),
    (lambda p: changed(p, r00=np.inf), 'no rigid pose for b'),
    (lambda p: changed(p, r00=0.5), 'no rigid pose for b'),
    (lambda p: changed(p, **dict.fromkeys(o.POSE_COLUMNS, 0.0)), 'no rigid pose for b'),
    (lambda p: changed(p, **{f'r{i}{j}': -(i == j) for i in range(3) for j in range(3)}),
     'no rigid pose for b'),
    (lambda p: changed(p, table_r00=0.5), 'no rigid pose for the table'),
    (lambda p: changed(p, table_x=0.5), 'no pose of the table that are the same in every row'),
    (lambda p: changed(p, noise_m=np.nan), 'noise_m'),
    (lambda p: changed(p, noise_m=0.0), 'noise_m'),
    (lambda p: changed(p, noise_m=0.5), 'the same in every row'),
    (lambda p: columns_of(p, [(n, 'f8') for n in NAMES[:-1]]), 'no field noise_m'),
    (lambda p: columns_of(p, [(n, 'f4') for n in NAMES]), 'not float64'),
    (lambda p: cloud_message(cloud_rows(p)[:1].copy(), HEAD), 'has 1 cameras, but here are 2'),
    (lambda p: cloud_message(cloud_rows(p)[:0].copy(), HEAD), 'parameter cameras')])
def test_what_are_no_poses_is_rejected(flaw, word):
    views, poses = messages_of(observe([a_view('a', 1), a_view('b', 2)]))
    with pytest.raises(HoocError, match=word):
        o.observation_from_messages(views, flaw(poses))


def test_big_endian_poses_are_read():
    observation = observe([a_view('a', 1)])
    views, poses = messages_of(observation)
    swapped = cloud_rows(poses).byteswap()
    message = cloud_message(swapped, HEAD)
    message.is_bigendian = True
    same_bits(o.observation_from_messages(views, message), observation)


def spoilt(view, flaw):
    """Return the ViewMessages of an ObservedView with a flaw."""
    info, depth = camera_info_message(view.camera, HEAD), depth_message(view.depth, HEAD)
    segments = o.segments_message(view, HEAD)
    pixels = view.foreground * np.uint8(1) | view.table * np.uint8(2)
    if flaw == 'other size':
        segments = image_message(pixels[1:], 'mono8', HEAD)
    elif flaw == 'cut':
        segments.data = segments.data[:-5]
    elif flaw == 'encoding':
        segments.encoding = '16UC1'
    elif flaw == 'bits':
        segments = image_message(pixels | 8, 'mono8', HEAD)
    elif flaw == 'unseen':
        segments = image_message(pixels | 1, 'mono8', HEAD)
    elif flaw == 'depth size':
        depth = depth_message(view.depth[:, 2:], HEAD)
    elif flaw == 'no readings':
        depth = depth_message(np.full_like(view.depth, np.nan), HEAD)
        segments = image_message(pixels & 2, 'mono8', HEAD)
    elif flaw == 'calibration':
        info.k = np.full(9, np.nan)
    return o.ViewMessages(info, depth, segments)


@pytest.mark.parametrize('flaw, word', [
    ('other size', 'views/a/segments is 120 x 89 pixels'), ('cut', 'needs'),
    ('encoding', 'mono8'), ('bits', 'unknown bits'), ('unseen', 'without a reading'),
    ('depth size', 'views/a/depth_rect is 118 x 90'), ('no readings', 'no reading at all'),
    ('calibration', 'camera_info of a')])
def test_what_is_no_view_is_rejected(flaw, word):
    observation = observe([a_view('a', 1)])
    with pytest.raises(HoocError, match=word):
        o.observation_from_messages({'a': spoilt(observation.views[0], flaw)},
                                    o.poses_message(observation, HEAD))


def test_a_table_beyond_the_horizon_is_rejected():
    observation = observe([a_view('a', 1)])
    views, _ = messages_of(observation)
    T = observation.views[0].camera.T_world_camera.copy()
    T[:3, :3] = T[:3, :3] @ np.diag([1.0, -1, -1])      # looks up
    above = replace(observation, views=(replace(
        observation.views[0], camera=replace(observation.views[0].camera, T_world_camera=T)),))
    with pytest.raises(HoocError, match='do not meet'):
        o.observation_from_messages(views, o.poses_message(above, HEAD))

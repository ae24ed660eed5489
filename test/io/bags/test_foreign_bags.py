# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Bags that other people recorded, and files that are no bags."""

import json

from hooc_perception.core.geometry import inverse, matrix_from_pose
from hooc_perception.core.render import render_depth
from hooc_perception.core.types import Camera
from hooc_perception.errors import HoocError
from hooc_perception.io.bags.reader import BagScene, iter_messages
import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import get_typestore, Stores
from scipy.spatial.transform import Rotation
import trimesh

TYPES = get_typestore(Stores.ROS2_JAZZY)
M = TYPES.types
HEIGHT, WIDTH = 60, 80
K = np.array([[70.0, 0, 39.5], [0, 71, 29.5], [0, 0, 1]])
IMAGE, INFO = 'sensor_msgs/msg/Image', 'sensor_msgs/msg/CameraInfo'


def header(frame, stamp_ns=0):
    return M['std_msgs/msg/Header'](
        M['builtin_interfaces/msg/Time'](*divmod(stamp_ns, 10 ** 9)), frame)


def image(data, encoding, step, frame, bigendian=0, stamp_ns=0, shape=(HEIGHT, WIDTH)):
    return M[IMAGE](header(frame, stamp_ns), *shape, encoding, bigendian, step,
                    np.frombuffer(data, np.uint8))


def depth_image(depth, frame='optical', stamp_ns=0):
    return image(depth.astype('<f4').tobytes(), '32FC1', 4 * WIDTH, frame, 0, stamp_ns)


def info(frame='optical', k=K, d=(), model='plumb_bob', p=None, width=WIDTH, height=HEIGHT):
    p = np.hstack([k, np.zeros((3, 1))]) if p is None else p
    roi = M['sensor_msgs/msg/RegionOfInterest'](0, 0, 0, 0, False)
    return M[INFO](header(frame), height, width, model, np.array(d, float), np.ravel(k),
                   np.eye(3).ravel(), np.ravel(p), 0, 0, roi)


def transform(parent, child, translation, quaternion=(0, 0, 0, 1)):
    return M['geometry_msgs/msg/TransformStamped'](
        header(parent), child, M['geometry_msgs/msg/Transform'](
            M['geometry_msgs/msg/Vector3'](*map(float, translation)),
            M['geometry_msgs/msg/Quaternion'](*map(float, quaternion))))


def tf(*transforms):
    return '/tf_static', 'tf2_msgs/msg/TFMessage', M['tf2_msgs/msg/TFMessage'](list(transforms))


def write(path, messages, storage=StoragePlugin.MCAP):
    """Write (topic, type, message) in their order, 1 ms apart."""
    with Writer(path, version=9, storage_plugin=storage) as writer:
        connections = {}
        for i, (topic, kind, message) in enumerate(messages):
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=TYPES)
            writer.write(connections[topic], i * 10 ** 6, TYPES.serialize_cdr(message, kind))
    return path


DEPTH = np.random.default_rng(0).uniform(0.5, 2, (HEIGHT, WIDTH)).astype(np.float32)
COLOUR_IMAGE = image(bytes(3 * HEIGHT * WIDTH), 'rgb8', 3 * WIDTH, 'colour')
MOUNT = (0.1, 0.2, 0.3), (0.0, 0.6, 0.0, 0.8)
OPTICAL = (0.0, 0.02, 0.0), (0.5, -0.5, 0.5, -0.5)
# Above a table, looking down on it.
ABOVE = (0.0, -0.6, 0.7), tuple(Rotation.from_euler('x', -140, degrees=True).as_quat())


def test_camera_named_by_its_topic_posed_by_a_tree(tmp_path):
    bag = write(tmp_path / 'kitchen', [
        tf(transform('/table', 'mount', *MOUNT), transform('elsewhere', 'robot', (9, 9, 9))),
        tf(transform('mount', '/optical', *OPTICAL)),
        ('/front/depth/camera_info', INFO, info(d=[0.1, 0.2, 0, 0])),
        ('/front/depth/image_raw', IMAGE, depth_image(DEPTH)),
        ('/front/color/image_raw', IMAGE, COLOUR_IMAGE),
    ])
    scene = BagScene(bag)
    assert scene.name == 'kitchen'
    assert (scene.info['dataset'], scene.truth, scene.labels()) == ('kitchen', None, None)
    view, = scene.views()
    assert view.camera.name == 'front'
    np.testing.assert_array_equal(view.depth, DEPTH)
    np.testing.assert_array_equal(view.camera.D, [0.1, 0.2, 0, 0, 0])
    expected = matrix_from_pose(*MOUNT) @ matrix_from_pose(*OPTICAL)
    np.testing.assert_allclose(view.camera.T_world_camera, expected, atol=1e-12)
    assert scene.table_known


def test_any_frame_of_the_tree_may_be_the_world(tmp_path):
    bag = write(tmp_path / 'b', [
        tf(transform('mount', 'optical', *OPTICAL), transform('mount', 'desk', (0, 0, 1))),
        ('/depth/camera_info', INFO, info()), ('/depth/image', IMAGE, depth_image(DEPTH))])
    scene = BagScene(bag, world_frame='desk')
    expected = inverse(matrix_from_pose([0, 0, 1], [0, 0, 0, 1])) @ matrix_from_pose(*OPTICAL)
    np.testing.assert_allclose(scene.cameras[0].T_world_camera, expected, atol=1e-12)
    with pytest.raises(HoocError, match='moon'):
        BagScene(bag, world_frame='moon')


@pytest.mark.parametrize('order, bigendian', [('<', 0), ('>', 1)])
@pytest.mark.parametrize('padding', [0, 6])
def test_millimetres_of_any_layout(tmp_path, order, bigendian, padding):
    counts = np.random.default_rng(1).integers(0, 5000, (HEIGHT, WIDTH))
    rows = [row.astype(order + 'u2').tobytes() + b'\xff' * padding for row in counts]
    bag = write(tmp_path / 'b', [
        tf(transform('table', 'optical', *ABOVE)), ('/c/depth/camera_info', INFO, info()),
        ('/c/depth/image_raw', IMAGE,
         image(b''.join(rows), '16UC1', 2 * WIDTH + padding, 'optical', bigendian))])
    expected = np.where(counts, counts / 1000, np.nan)
    np.testing.assert_allclose(BagScene(bag).views()[0].depth, expected, atol=1e-6)


def test_the_raw_image_goes_before_the_rectified_one(tmp_path):
    P = np.array([[90.0, 0, 39, 0], [0, 91, 29, 0], [0, 0, 1, 0]])
    rectified = [tf(transform('table', 'optical', *ABOVE)),
                 ('/c/depth/camera_info', INFO, info(d=[0.1, 0, 0, 0, 0], p=P)),
                 ('/c/depth/image_rect', IMAGE, depth_image(DEPTH + 1))]
    scene = BagScene(write(tmp_path / 'rectified', rectified))
    np.testing.assert_array_equal(scene.cameras[0].K, P[:, :3])
    assert not scene.cameras[0].D.any()
    raw = [*rectified, ('/c/depth/image_raw', IMAGE, depth_image(DEPTH))]
    scene = BagScene(write(tmp_path / 'raw', raw))
    np.testing.assert_array_equal(scene.views()[0].depth, DEPTH)
    np.testing.assert_array_equal(scene.cameras[0].K, K)


def test_infrared_is_not_depth(tmp_path):
    infrared = image(bytes(2 * HEIGHT * WIDTH), 'mono16', 2 * WIDTH, 'optical')
    bag = write(tmp_path / 'b', [
        tf(transform('table', 'optical', *OPTICAL)), ('/c/ir/image_raw', IMAGE, infrared),
        ('/c/depth/camera_info', INFO, info()), ('/c/depth/image_raw', IMAGE, depth_image(DEPTH))])
    assert BagScene(bag).depth_topics == {'c': '/c/depth/image_raw'}


def test_cameras_that_start_apart_meet(tmp_path):
    messages = [tf(transform('table', 'a', *ABOVE), transform('table', 'b', *ABOVE))]
    messages += [(f'/{c}/depth/camera_info', INFO, info(c)) for c in 'ab']
    for i in range(6):
        messages.append(('/a/depth/image_raw', IMAGE, depth_image(DEPTH + i, 'a', i * 100)))
        if i >= 3:
            messages.append(
                ('/b/depth/image_raw', IMAGE, depth_image(DEPTH + i, 'b', i * 100 + 40)))
    a, b = BagScene(write(tmp_path / 'b', messages)).views()
    np.testing.assert_array_equal(b.depth, DEPTH + 3)
    np.testing.assert_array_equal(a.depth, DEPTH + 3)


def test_table_is_estimated_where_nobody_knows_it(tmp_path):
    table, box = trimesh.creation.box((1.2, 1.2, 0.02)), trimesh.creation.box((0.1, 0.2, 0.1))
    meshes = [(table.vertices - [0, 0, 0.01], table.faces.astype(np.int32)),
              (box.vertices + [0, 0, 0.05], box.faces.astype(np.int32))]
    T_table_camera = np.eye(4)
    T_table_camera[:3, :3] = Rotation.from_euler('x', -140, degrees=True).as_matrix()
    T_table_camera[:3, 3] = [0, -0.6, 0.7]
    depth, _ = render_depth(meshes, Camera('c', WIDTH, HEIGHT, K, np.zeros(5), T_table_camera))
    bag = write(tmp_path / 'b', [('/c/depth/camera_info', INFO, info()),
                                 ('/c/depth/image_raw', IMAGE, depth_image(depth))])
    scene = BagScene(bag)
    assert not scene.table_known
    assert scene.cameras[0].T_world_camera[2, 3] == pytest.approx(0.7, abs=0.005)
    assert scene.views()[0].camera is scene.cameras[0]
    assert scene.world['world']['estimated_from'] == 'dominant support plane'


GOOD = [tf(transform('table', 'optical', *OPTICAL)), ('/c/depth/camera_info', INFO, info()),
        ('/c/depth/image_raw', IMAGE, depth_image(DEPTH))]
ROTATED = tf(transform('table', 'optical', (0, 0, 0), (0, 0, 0, 0)))
COLOUR = '/c/depth/image_raw', IMAGE, COLOUR_IMAGE
SHORT = ('/c/depth/image_raw', IMAGE, image(bytes(10), '32FC1', 4 * WIDTH, 'optical'))
EMPTY = ('/c/depth/image_raw', IMAGE, depth_image(DEPTH * np.nan))
SECOND = [('/d/depth/camera_info', INFO, info('other')),
          ('/d/depth/image_raw', IMAGE, depth_image(DEPTH, 'other'))]
CALIBRATION = '/c/depth/camera_info'
ERRORS = {
    'no depth topic': ([*GOOD[:2], COLOUR], ('no depth topic', '/c/depth/image_raw (rgb8)')),
    'no image': (GOOD[:2], ('no depth topic',)),
    'no camera_info': ([GOOD[0], GOOD[2]], (CALIBRATION, 'missing')),
    'singular K': ([GOOD[0], (CALIBRATION, INFO, info(k=np.zeros((3, 3)))), GOOD[2]],
                   (CALIBRATION, 'K', 'no calibration')),
    'fisheye': ([GOOD[0], (CALIBRATION, INFO, info(d=[.1] * 4, model='equidistant')), GOOD[2]],
                (CALIBRATION, 'equidistant')),
    'other size': ([GOOD[0], (CALIBRATION, INFO, info(width=640)), GOOD[2]],
                   (CALIBRATION, '640', 'width')),
    'no quaternion': ([ROTATED, *GOOD[1:]], ('/tf_static', 'optical', 'quaternion')),
    'short image': ([*GOOD[:2], SHORT], ('/c/depth/image_raw', 'bytes')),
    'no reading': ([*GOOD[:2], EMPTY], ('/c/depth/image_raw', 'no reading')),
    'not connected': ([*GOOD, *SECOND], ("'other'", '/d/extrinsics')),
}


@pytest.mark.parametrize('name', ERRORS)
def test_bags_that_lack_something(tmp_path, name):
    messages, words = ERRORS[name]
    bag = write(tmp_path / 'b', messages)
    with pytest.raises(HoocError) as error:
        BagScene(bag).views()
    assert '\n' not in str(error.value)
    for word in (str(bag), *words):
        assert word in str(error.value)


def test_a_message_of_another_content(tmp_path):
    bag = tmp_path / 'b'
    with Writer(bag, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connection = writer.add_connection('/c/depth/image_raw', IMAGE, typestore=TYPES)
        writer.write(connection, 0, b'\0\1\0\0junk')
    with pytest.raises(HoocError, match=r'/c/depth/image_raw is damaged'):
        BagScene(bag)


@pytest.mark.parametrize('storage', [StoragePlugin.MCAP, StoragePlugin.SQLITE3])
@pytest.mark.parametrize('share', [0.0, 0.05, 0.5, 0.97])
def test_truncated_bags(tmp_path, storage, share):
    bag = write(tmp_path / 'b', GOOD, storage)
    file, = (f for f in bag.iterdir() if f.suffix in ('.mcap', '.db3'))
    data = file.read_bytes()
    file.write_bytes(data[:int(share * len(data))])
    with pytest.raises(HoocError) as error:
        BagScene(bag).views()
    assert '\n' not in str(error.value)
    assert str(bag) in str(error.value)


def test_damage_anywhere_is_an_error_or_harmless(tmp_path):
    rng = np.random.default_rng(0)
    bag = write(tmp_path / 'b', GOOD)
    data = np.frombuffer((bag / 'b.mcap').read_bytes(), np.uint8)
    for _ in range(60):
        damaged = data.copy()
        damaged[rng.integers(len(data), size=20)] = rng.integers(256, size=20)
        (bag / 'b.mcap').write_bytes(damaged.tobytes())
        try:
            BagScene(bag).views()
        except HoocError as error:
            assert '\n' not in str(error)


@pytest.mark.parametrize('name', ['none', 'text.mcap', 'text.txt', 'text.db3'])
def test_no_bag_at_all(tmp_path, name):
    if name != 'none':
        (tmp_path / name).write_text('hello')
    with pytest.raises(HoocError, match=f'{name}: .*;'):
        list(iter_messages(tmp_path / name))


STRING = 'std_msgs/msg/String'
OBJECT = {'category': 'ball', 'translation': [0, 0, 0.1], 'rotation_xyzw': [0, 0, 0, 1],
          'size': [0.1, 0.1, 0.1]}


def bag_of(path, told, depths=(1.0,), *more):
    messages = [] if told is None else [('/hooc/scene_info', STRING, M[STRING](json.dumps(told)))]
    messages += more
    messages.append(('/c/depth/camera_info', INFO, info()))
    for i, value in enumerate(depths):
        messages.append(('/c/depth/image_raw', IMAGE, depth_image(
            np.full((60, 80), value, np.float32), stamp_ns=(i + 1) * 10 ** 9)))
    return write(path, messages)


@pytest.mark.parametrize('told', [
    {'cameras': 5}, {'cameras': [{'a': 1}]}, {'world_frame': 3}, {'max_instances': 'abc'},
    {'max_instances': -7}, {'max_instances': 1.5}, {'dataset': 5}, {'scene': 7},
    {'scene': '../../escaped'}, {'scene': '..'}, {'scene': '/etc/x'}, {'categories': 'ball'},
    {'truth': 3}, {'truth': [{**OBJECT, 'size': [0, 0, 0]}]},
    {'truth': [{**OBJECT, 'surface_visibility': 'x'}]},
    {'truth': [{**OBJECT, 'category': '../x'}]},
])
def test_a_key_that_cannot_be_meant_is_named(tmp_path, told):
    with pytest.raises(HoocError, match=f'/hooc/scene_info {next(iter(told))}'):
        BagScene(bag_of(tmp_path / 'b', told))


def test_absent_keys_and_null_leave_the_choice_to_the_model(tmp_path):
    for i, told in enumerate((None, {}, {'max_instances': None, 'scene': None, 'dataset': None})):
        bag = BagScene(bag_of(tmp_path / f'b{i}', told))
        assert (bag.name, bag.info['dataset'], bag.info['max_instances']) == (f'b{i}', f'b{i}', -1)
    assert BagScene(bag_of(tmp_path / 'n', {'max_instances': 0})).info['max_instances'] == 0


def test_views_of_a_later_frame_set(tmp_path):
    bag = BagScene(bag_of(tmp_path / 'b', {'world_frame': None}, (1.0, 0.0, 2.0),
                          tf(transform('table', 'optical', *ABOVE))))
    assert bag.views()[0].depth[0, 0] == 1
    assert bag.views({'c': 0})[0].depth[0, 0] == 1
    # The second holds no reading, so no frame set is made of it.
    assert bag.views({'c': 1})[0].depth[0, 0] == bag.views({'c': 2})[0].depth[0, 0] == 2
    with pytest.raises(HoocError, match='no such frame set'):
        bag.views({'c': 3})


def test_zeros_behind_the_coefficients_and_a_skew_are_taken_as_live_nodes_take_them(tmp_path):
    lens, skew = [0.1, -0.2, 0.001, 0.002, 0.01, 0.3, 0.1, 0.02], np.array(K)
    skew[0, 1] = 2.0
    for i, (zeros, accepted) in enumerate((([0.0] * 6, True), ([0.0] * 5 + [0.1], False))):
        bag = write(tmp_path / f'b{i}', [
            ('/c/depth/camera_info', INFO, info(k=skew, d=lens + zeros,
                                                model='rational_polynomial')),
            ('/c/depth/image_raw', IMAGE, depth_image(DEPTH))])
        if accepted:
            camera, = BagScene(bag).source_cameras
            np.testing.assert_array_equal(camera.D, lens)
            np.testing.assert_array_equal(camera.K, skew)
        else:
            with pytest.raises(HoocError, match='D has 14 numbers'):
                BagScene(bag)

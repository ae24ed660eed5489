# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Topics, frames and units as drivers and users have them: the same scene comes out."""

import struct

import cv2
from hooc_perception.errors import HoocError
from hooc_perception.io.bags.files import iter_messages
from hooc_perception.io.bags.notes import notes_file
from hooc_perception.io.bags.reader import BagScene
import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import get_typestore, Stores
from scipy.spatial.transform import Rotation

TYPES = get_typestore(Stores.ROS2_JAZZY)
IMAGE, INFO = 'sensor_msgs/msg/Image', 'sensor_msgs/msg/CameraInfo'
COMPRESSED, TF = 'sensor_msgs/msg/CompressedImage', 'tf2_msgs/msg/TFMessage'


@pytest.fixture
def rewrite(sound_bag, tmp_path):
    """Return a function that writes the sound bag anew through `edit(topic, type, message)`."""
    def write(edit, name='b'):
        with Writer(tmp_path / name, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
            connections = {}
            for old in iter_messages(sound_bag):
                for topic, kind, message in edit(old.topic.name, old.topic.type_name,
                                                 old.read(sound_bag)):
                    if topic not in connections:
                        connections[topic] = writer.add_connection(topic, kind, typestore=TYPES)
                    writer.write(connections[topic], old.time_ns,
                                 TYPES.serialize_cdr(message, kind))
        return tmp_path / name
    return write


def same(bag, sound_bag, atol=0.0):
    """Assert that a bag holds the views of the sound bag."""
    found, expected = BagScene(bag).views(), BagScene(sound_bag).views()
    for view, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(view.depth, other.depth, atol=atol, rtol=0)
        np.testing.assert_allclose(view.camera.T_world_camera, other.camera.T_world_camera)
        np.testing.assert_array_equal(view.camera.K, other.camera.K)


def counts_of(image):
    """Return the (H, W) uint16 pixels of an Image message."""
    return np.frombuffer(image.data, '<u2').reshape(image.height, image.width)


def image_of(image, pixels, encoding='16UC1'):
    """Return an Image message with other pixels."""
    pixels = np.ascontiguousarray(pixels)
    return TYPES.types[IMAGE](image.header, *pixels.shape, encoding, 0, pixels.strides[0],
                              pixels.reshape(-1).view(np.uint8))


def compressed(image, head=struct.pack('<iff', 0, 0, 0), form='16UC1; compressedDepth png'):
    """Return the CompressedImage of an Image message."""
    data = head + cv2.imencode('.png', counts_of(image))[1].tobytes()
    return TYPES.types[COMPRESSED](image.header, form, np.frombuffer(data, np.uint8))


@pytest.mark.parametrize('suffix, head, form', [
    ('compressedDepth', struct.pack('<iff', 0, 0, 0), '16UC1; compressedDepth png'),
    ('compressed', b'', '16UC1; png compressed ')])
def test_compressed_depth_alone(rewrite, sound_bag, suffix, head, form):
    bag = rewrite(lambda topic, kind, message: [
        (f'{topic}/{suffix}', COMPRESSED, compressed(message, head, form))
        if topic.endswith('image_raw') else (topic, kind, message)])
    same(bag, sound_bag)


def test_the_raw_image_goes_before_the_compressed_one(rewrite, sound_bag):
    def edit(topic, kind, message):
        yield topic, kind, message
        if topic.endswith('image_raw'):
            yield (f'{topic}/compressedDepth', COMPRESSED,
                   compressed(image_of(message, counts_of(message) + np.uint16(9))))
    bag = rewrite(edit)
    same(bag, sound_bag)
    assert 'compressedDepth' in BagScene(bag).warnings[0]


# Per driver: the topic that is meant, its calibration, and others of the same camera.
DRIVERS = {
    'realsense2': ('/{0}/camera/depth/image_rect_raw', '/{0}/camera/depth/camera_info', [
        '/{0}/camera/aligned_depth_to_color/image_raw',
        '/{0}/camera/aligned_depth_to_infra1/image_raw']),
    'azure_kinect': ('/{0}/depth/image_raw', '/{0}/depth/camera_info',
                     ['/{0}/depth_to_rgb/image_raw']),
    'openni': ('/{0}/depth/image_raw', '/{0}/depth/camera_info', [
        '/{0}/depth_registered/image_raw', '/{0}/depth_registered/hw_registered/image_rect_raw',
        '/{0}/depth/image_rect', '/{0}/depth/image']),
    'kinect2_bridge': ('/{0}/sd/image_depth', '/{0}/sd/camera_info', [
        '/{0}/sd/image_depth_rect', '/{0}/qhd/image_depth_rect', '/{0}/hd/image_depth_rect']),
    'zed': ('/{0}/zed_node/depth/depth_registered', '/{0}/zed_node/depth/camera_info', []),
    'zivid': ('/{0}/depth/image', '/{0}/depth/camera_info', []),
    'gazebo': ('/{0}/depth_image', '/{0}/camera_info', []),
    'unity': ('/{0}/depth/image_raw', '/{0}/camera_info', []),
}


@pytest.mark.parametrize('driver', DRIVERS)
def test_one_depth_topic_of_each_camera_is_chosen(driver, rewrite, sound_bag):
    image_topic, info_topic, others = DRIVERS[driver]

    def edit(topic, kind, message):
        camera = topic.split('/')[2] if topic.startswith('/hooc/camera') else ''
        if topic.endswith('image_raw'):
            for other in others:
                yield other.format(camera), kind, image_of(message, counts_of(message) // 2 * 2)
            yield image_topic.format(camera), kind, message
        elif topic.endswith('camera_info'):
            for place in {info_topic, *(f'{o.rpartition("/")[0]}/camera_info' for o in others)}:
                yield place.format(camera), kind, message
        elif topic == '/tf_static':
            yield topic, kind, message
    scene = BagScene(rewrite(edit))
    assert list(scene.depth_topics.values()) == [image_topic.format(c)
                                                 for c in ('camera0', 'camera1')]
    assert len(scene.warnings) == (2 if others else 0)
    assert all(o.format('camera0') in scene.warnings[0] for o in others)
    same(scene.path, sound_bag)


def without_extrinsics(change):
    """Return an edit that keeps /tf_static through `change`, and images."""
    def edit(topic, kind, message):
        if topic == '/tf_static':
            yield from change(message)
        elif topic.endswith(('image_raw', 'camera_info')):
            yield topic, kind, message
    return edit


def test_frames_that_stand_still_on_tf_are_used(rewrite, sound_bag):
    def change(message):
        for shift in (0.0, 0.0002, -0.0001):
            for stamped in message.transforms:
                stamped.transform.translation.x += shift
            yield '/tf', TF, message
    same(rewrite(without_extrinsics(change)), sound_bag, 1e-3)


@pytest.mark.parametrize('moves', ['translation', 'rotation'])
def test_a_camera_that_moves_is_named(rewrite, moves):
    def change(message):
        yield '/tf', TF, message
        pose = message.transforms[1].transform
        if moves == 'translation':
            pose.translation.x += 0.01
        else:
            q = pose.rotation
            turned = Rotation.from_quat([q.x, q.y, q.z, q.w]) * Rotation.from_rotvec([0, 0.01, 0])
            q.x, q.y, q.z, q.w = turned.as_quat().tolist()
        yield '/tf', TF, message
    with pytest.raises(HoocError, match=r'camera1.*moves in .table. on /tf'):
        BagScene(rewrite(without_extrinsics(change)))


def nameless(topic, kind, message):
    """Take the frame_id of images and calibrations away."""
    if topic.endswith(('image_raw', 'camera_info')):
        message.header.frame_id = ''
    yield topic, kind, message


def test_images_without_frame_id_take_the_extrinsics_of_their_camera(rewrite, sound_bag):
    same(rewrite(nameless), sound_bag)


def test_images_without_any_pose_are_told_from_lost_transforms(rewrite):
    def edit(topic, kind, message):
        if not topic.endswith('extrinsics'):
            yield from nameless(topic, kind, message)
    with pytest.raises(HoocError, match='camera0/depth/image_raw carry no frame_id'):
        BagScene(rewrite(edit))


def test_two_cameras_of_one_frame_are_told(rewrite):
    def edit(topic, kind, message):
        if topic.endswith(('image_raw', 'camera_info')):
            message.header.frame_id = 'camera0_depth_optical_frame'
        if not topic.endswith('extrinsics'):
            yield topic, kind, message
    with pytest.raises(HoocError, match='camera0 and camera1 carry the same frame_id'):
        BagScene(rewrite(edit))


@pytest.mark.parametrize('unit, dtype', [
    (0.0001, 'u2'), (0.000125, 'u2'), (0.0254, 'u2'), (1.0, 'u2'), (0.001, 'f4'), (0.0254, 'f4'),
    (0.01, 'f4')])
def test_other_units_are_named_and_read_where_stated(rewrite, sound_bag, unit, dtype):
    def edit(topic, kind, message):
        if topic.endswith('image_raw'):
            values = counts_of(message) * (0.001 / unit)
            message = image_of(message, np.rint(values).astype('u2') if dtype == 'u2' else
                               values.astype('f4'), '16UC1' if dtype == 'u2' else '32FC1')
        yield topic, kind, message
    bag = rewrite(edit)
    named = 'depth_unit' if unit == 0.000125 else rf'depth_unit {unit:g}\)'
    with pytest.raises(HoocError, match=named):
        BagScene(bag).views()
    for text in (f'depth_unit: {unit}', f'depth_unit: {{camera0: {unit}, camera1: {unit}}}'):
        notes_file(bag).write_text(text)
        same(bag, sound_bag, unit)


def test_a_user_can_say_that_images_are_rectified(rewrite):
    def edit(topic, kind, message):
        if kind == INFO:
            message.d, message.p = np.full(5, 0.01), message.p.copy()
            message.p[0] = 170
        yield topic, kind, message
    bag = rewrite(edit)
    raw = BagScene(bag).cameras[0]
    notes_file(bag).write_text('rectified: {camera0: true}\n')
    rectified, other = BagScene(bag).cameras
    assert raw.D.any() and other.D.any() and not rectified.D.any()
    assert (raw.K[0, 0], rectified.K[0, 0]) == (180, 170)


@pytest.mark.parametrize('text, words', [
    ('depth_units: 0.001', 'depth_unit'), ('depth_unit: 1mm', 'depth_unit'),
    ('depth_unit: 0', 'metres per count'), ('rectified: maybe', 'true or false'),
    ('world_frame: 3', 'world_frame')])
def test_notes_that_cannot_be_meant(rewrite, text, words):
    bag = rewrite(lambda *message: [message])
    notes_file(bag).write_text(text)
    with pytest.raises(HoocError, match=f'hooc.yaml.*{words}'):
        BagScene(bag)

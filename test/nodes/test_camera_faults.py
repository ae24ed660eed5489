# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What cameras do in real life: the chain goes on, says why not, and recovers by itself."""

from dataclasses import replace
import importlib.util
from pathlib import Path

import numpy as np
import pytest

rclpy = pytest.importorskip('rclpy')

from hooc_perception.ros.messages import conversions as c  # noqa: E402
from hooc_perception.ros.qos import qos  # noqa: E402
from rclpy.qos import QoSProfile, ReliabilityPolicy  # noqa: E402
from sensor_msgs.msg import CameraInfo, CompressedImage, Image  # noqa: E402

spec = importlib.util.spec_from_file_location('raw_camera', Path(__file__).with_name(
    'raw_camera.py'))
raw_camera = importlib.util.module_from_spec(spec)
spec.loader.exec_module(raw_camera)
W, H, start, a_depth = raw_camera.W, raw_camera.H, raw_camera.start, raw_camera.a_depth
HEAD = c.header(0, '')
S = 10 ** 9


class Clock:
    """Stamps that rise by 50 ms."""

    def __init__(self, start_ns=1000 * S):
        self.ns = start_ns

    def tick(self):
        self.ns += 50_000_000
        return self.ns


def standing(bench, raw):
    for camera in raw:
        camera.stand()
    bench.rest(0.2)


def run(bench, clock, raw, until=lambda: False, sets=40):
    """Send sets from some cameras until a condition holds; return whether it came to hold."""
    for _ in range(sets):
        stamp = clock.tick()
        for camera in raw:
            camera.send(stamp)
        bench.rest(0.02)
        if until():
            return True
    return False


def blind(message):
    """Return whether a rectified image stands for a camera that is not there."""
    return not np.isfinite(c.depth_from_message(message)).any()


@pytest.mark.parametrize('n', [1, 8])
def test_one_to_eight_cameras_of_any_resolution(bench, n):
    names = [f'c{i}' for i in range(n)]
    node, raw, heard = start(bench, *names)
    standing(bench, raw)
    depths = {}
    for i, camera in enumerate(raw):
        w, h = 40 + 16 * i, 30 + 10 * i
        camera.camera = raw_camera.resized(camera.camera, w, h)
        depths[camera.name] = np.full((h, w), 700 + i, np.uint16)
        camera.send(5 * S + i, depths[camera.name])
    assert bench.spin(lambda: all(heard.values()))
    for name, counts in depths.items():
        (image,) = heard[name]
        assert (image.height, image.width) == counts.shape
        assert np.nanmax(c.depth_from_message(image)) == pytest.approx(counts[0, 0] / 1000)


def test_a_camera_drops_out_and_returns(bench):
    node, raw, heard = start(bench, 'a', 'b', 'c', camera_timeout_s=0.4, explain_after_s=0.5)
    standing(bench, raw)
    clock = Clock()
    assert run(bench, clock, raw, lambda: len(heard['b']) > 3)
    # The set is whole: the place of the lost camera is kept by an image without readings.
    assert run(bench, clock, [raw[0], raw[2]], lambda: blind(heard['b'][-1]), sets=200)
    assert (heard['b'][-1].width, heard['b'][-1].height) == (W, H)
    bench.rest(0.3)
    assert not blind(heard['a'][-1])
    assert heard['b'][-1].header.stamp == heard['a'][-1].header.stamp
    code, sentence = bench.reasons(node)['views']
    assert code == 'fewer_cameras' and 'b is left out' in sentence and '2 of 3' in sentence
    assert run(bench, clock, [raw[0], raw[2]], lambda: bench.reasons(node).get('b', ' ')[0]
               == 'no_messages', sets=200)
    # Its driver is started again.
    assert run(bench, clock, raw, lambda: not blind(heard['b'][-1]))
    assert node.work.assembly.sets.lost == {}


def test_a_camera_that_was_never_there_does_not_stop_the_others(bench):
    node, (raw, _), heard = start(bench, 'a', 'z', camera_timeout_s=0.3)
    standing(bench, [raw])
    assert run(bench, Clock(), [raw], lambda: heard['z'])
    assert blind(heard['z'][0])


def test_one_bad_camera_does_not_spoil_the_sets_of_the_others(bench):
    node, raw, heard = start(bench, 'a', 'b', camera_timeout_s=0.3)
    standing(bench, raw)
    clock = Clock()
    for _ in range(40):
        stamp = clock.tick()
        raw[0].send(stamp)
        raw[1].send(stamp, np.zeros((H, W), np.uint16))
        bench.rest(0.02)
    assert bench.spin(lambda: len(heard['a']) > 5)
    assert bench.reasons(node)['b'][0] == 'no_readings'


FLOAT = {'millimetres': np.full((H, W), 900.0, np.float32),
         'infinite': np.full((H, W), np.inf, np.float32),
         'nan': np.full((H, W), np.nan, np.float32),
         'negative': np.full((H, W), -1.0, np.float32)}


def odd_message(flaw):
    """Return the Image of a flaw."""
    if flaw in FLOAT:
        return c.image_message(FLOAT[flaw], '32FC1', HEAD)
    counts = {'metres': 1, 'zeros': 0, 'saturated': 65535}.get(flaw, 900)
    message = c.image_message(np.full((H, W), counts, np.uint16), '16UC1', HEAD)
    if flaw == 'short':
        message.data = message.data[:-100]
    elif flaw == 'absurd step':
        message.step = 3
    elif flaw == 'empty':
        message.width = message.height = message.step = 0
        message.data = message.data[:0]
    elif flaw == 'gigantic':
        message.width = message.height = 2 ** 31
        message.step = 2 ** 32 - 1
    elif flaw == 'encoding':
        message.encoding = 'rgb8'
    return message


@pytest.mark.parametrize('flaw, reason, word', [
    ('metres', 'wrong_unit', 'seems to hold metres'),
    ('millimetres', 'wrong_unit', 'millimetres'), ('saturated', 'wrong_unit', 'saturated'),
    ('infinite', 'no_readings', 'NaN'), ('nan', 'no_readings', 'NaN'),
    ('negative', 'no_readings', 'no reading'), ('zeros', 'no_readings', 'no reading'),
    ('short', 'bad_image', 'needs'), ('absurd step', 'bad_image', 'step'),
    ('empty', 'bad_image', 'empty'), ('gigantic', 'bad_image', 'needs'),
    ('encoding', 'bad_image', 'rgb8')])
def test_images_that_cannot_be_meant_are_refused_and_the_next_is_used(bench, flaw, reason, word):
    node, (raw,), heard = start(bench, 'a')
    standing(bench, [raw])
    for i in range(2):
        raw.send((i + 1) * S, message=odd_message(flaw))
        bench.rest(0.03)
    assert bench.spin(lambda: bench.reasons(node).get('a', ' ')[0] == reason), bench.reasons(node)
    assert word in bench.reasons(node)['a'][1] and heard['a'] == []
    raw.send(3 * S)
    assert bench.spin(lambda: heard['a'])


def test_resolution_and_encoding_may_change_between_frames(bench):
    node, (raw,), heard = start(bench, 'a', fuse_frames=3, incremental=False)
    standing(bench, [raw])
    raw.send(S)
    assert bench.spin(lambda: len(heard['a']) == 1)
    raw.camera = raw_camera.resized(raw.camera, 32, 24)
    raw.send(2 * S, np.full((24, 32), 800, np.uint16))
    assert bench.spin(lambda: len(heard['a']) == 2)
    metres = np.full((24, 32), 0.8, np.float32)
    raw.send(3 * S, message=c.image_message(metres, '32FC1', HEAD))
    assert bench.spin(lambda: len(heard['a']) == 3)
    assert heard['a'][1].data == heard['a'][2].data and heard['a'][1].width == 32


@pytest.mark.parametrize('flaw, reason, word', [
    ('zero K', 'bad_calibration', 'no calibration'), ('nan K', 'bad_calibration', 'contains nan'),
    ('zero size', 'bad_calibration', '0 x 0'), ('model', 'bad_calibration', 'fisheye'),
    ('no rotation', 'bad_extrinsics', 'rigid'), ('nan pose', 'bad_extrinsics', 'rigid'),
    ('inverted', 'absurd_extrinsics', 'below the table'),
    ('millimetres', 'absurd_extrinsics', 'in metres'),
    ('looks up', 'absurd_extrinsics', 'looks up')])
def test_calibrations_that_cannot_be_meant(bench, flaw, reason, word):
    node, (raw,), heard = start(bench, 'a')
    standing(bench, [raw])
    head = c.header(S, 'a_optical')
    info = c.camera_info_message(raw.camera, head)
    translation, rotation = [0.1, 0.2, 1.0], raw_camera.ROTATION
    if flaw == 'zero K':
        info.k = np.zeros(9)
    elif flaw == 'nan K':
        info.k = np.full(9, np.nan)
    elif flaw == 'zero size':
        info.width = info.height = 0
    elif flaw == 'model':
        info.distortion_model = 'fisheye'
    else:
        translation = {'inverted': [0.1, 0.2, -1.0], 'nan pose': [np.nan, 0, 1],
                       'millimetres': [100.0, 200.0, 1000.0]}.get(flaw, translation)
        rotation = {'no rotation': [0.0, 0, 0, 0], 'looks up': [0.0, 0, 0, 1]}.get(flaw, rotation)
        raw.poses.publish(c.transform_message(translation, rotation, c.header(0, 'table'), 'a'))
        bench.rest(0.2)
    raw.infos.publish(info)
    raw.send(S, info=False)
    assert bench.spin(lambda: bench.reasons(node).get('a', ' ')[0] == reason), bench.reasons(node)
    assert word in bench.reasons(node)['a'][1] and heard['a'] == []
    # The driver has found its calibration.
    raw.stand()
    bench.rest(0.2)
    raw.send(2 * S)
    assert bench.spin(lambda: heard['a'])


def test_stamps_of_a_looped_bag_and_of_zero(bench):
    node, raw, heard = start(bench, 'a', 'b')
    standing(bench, raw)
    drops = node.work.assembly.sets.drops
    for i in range(3):
        for k in range(3):
            for camera in raw:
                camera.send((100 + k) * S)
                camera.send(0)
            bench.rest(0.05)
            # A machine that is busy may take longer, and only four messages are kept.
            bench.spin(lambda: drops['b', 'no_stamp'] == 3 * i + k + 1)
        assert bench.spin(lambda: len(heard['a']) == 3 * (i + 1)), (i, heard['a'])
    assert drops['a', 'no_stamp'] == 9 and drops['a', 'time_jump'] == 2


def test_drivers_that_stamp_calibrations_differently_lose_one_frame(bench):
    node, (raw,), heard = start(bench, 'a')
    standing(bench, [raw])
    for i in range(1, 7):
        head = c.header(i * S + 12345, 'a_optical')
        raw.infos.publish(c.camera_info_message(raw.camera, head))
        raw.send(i * S, info=False)
        bench.rest(0.05)
    assert bench.spin(lambda: len(heard['a']) == 5)


@pytest.mark.parametrize('flaw, reason, word', [
    ('nobody', 'no_publisher', 'start its driver'),
    ('another name', 'no_publisher', '/left/depth/image_rect_raw'),
    ('another type', 'wrong_type', 'CompressedImage'),
    ('best effort', 'qos_mismatch', 'image_reliability'),
    ('mute', 'no_messages', 'nothing arrives'),
    ('no info', 'no_camera_info', 'nobody publishes /hooc/a/depth/camera_info')])
def test_silence_is_explained(bench, flaw, reason, word):
    from hooc_perception.nodes.ingestion_node import IngestionNode
    # In one process, a topic could not have two types.
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=bench.context.get_domain_id())
    driver = rclpy.create_node('driver', namespace='/hooc', context=context)
    make, images = driver.create_publisher, 'a/depth/image_raw'
    best_effort = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    publisher = {
        'nobody': lambda: None,
        'another name': lambda: make(Image, '/left/depth/image_rect_raw', 1),
        'another type': lambda: make(CompressedImage, images, 1),
        'best effort': lambda: make(Image, images, best_effort),
        'mute': lambda: make(Image, images, 1), 'no info': lambda: make(Image, images, 1)}[flaw]()
    node = bench.add(IngestionNode, cameras=['a'], warm_up=False, explain_after_s=0.5,
                     image_reliability='reliable')
    assert node.trigger_configure() and node.trigger_activate()

    def explained():
        if flaw == 'no info' and publisher.get_subscription_count():
            publisher.publish(c.image_message(a_depth(), '16UC1', c.header(
                node.now_ns(), 'a')))
            bench.rest(0.05)
        return bench.reasons(node).get('a', ' ')[0] == reason
    found, reasons = bench.spin(explained), bench.reasons(node)
    driver.destroy_node()
    rclpy.try_shutdown(context=context)
    assert found, reasons
    assert word in reasons['a'][1]


def test_a_camera_that_sees_no_table_is_named(bench):
    node, (raw,), heard = start(bench, 'a')
    raw.poses.publish(c.transform_message([0.0, 0.0, 1.0], [1.0, 0, 0, 0], c.header(0, 'table'),
                                          'a'))
    bench.rest(0.2)
    raw.camera = raw_camera.resized(raw.camera, 640, 480)
    counts = np.full((480, 640), 850, np.uint16)
    raw.send(S, counts)
    assert bench.spin(lambda: 'a' in bench.reasons(node) and heard['a'])
    code, sentence = bench.reasons(node)['a']
    assert code == 'no_table' and 'z = 0.1' in sentence


def test_recorded_stamps_without_their_clock_are_explained(bench):
    node, (raw,), heard = start(bench, 'a')
    from rclpy.parameter import Parameter
    assert node.set_parameters([Parameter('max_frame_age_s', value=1.0)])[0].successful
    standing(bench, [raw])
    raw.send(S)
    assert bench.spin(lambda: bench.reasons(node).get('a', ' ')[0] == 'stale')
    assert 'use_sim_time' in bench.reasons(node)['a'][1]
    raw.send(node.now_ns() + 30 * S)
    assert bench.spin(lambda: bench.reasons(node)['a'][0] == 'future')
    assert heard['a'] == []
    raw.send(node.now_ns())
    assert bench.spin(lambda: heard['a'])


def test_fusion_is_the_median_of_the_last_frames(bench):
    node, (raw,), heard = start(bench, 'a', fuse_frames=3, incremental=False)
    raw.camera = replace(raw.camera, D=np.zeros(5))
    standing(bench, [raw])
    counts = bench.hear(Image, 'views/a/count', qos('views/<camera>/count'))
    bench.rest(0.3)
    for i, value in enumerate([1000, 1010, 1002]):
        depth = np.full((H, W), value, np.uint16)
        depth[0, 0] = 0 if i else 900
        raw.send((i + 1) * S, depth)
        assert bench.spin(lambda: len(heard['a']) == i + 1)
    fused = c.depth_from_message(heard['a'][-1])
    assert fused[5, 5] == pytest.approx(1.002) and np.isnan(fused[0, 0])
    assert bench.spin(lambda: len(counts) == 2)
    seen = c.labels_from_message(counts[-1])
    assert seen[5, 5] == 3 and seen[0, 0] == 1
    # The scene is another one: nothing of the old is mixed into it.
    raw.send(9 * S, np.full((H, W), 700, np.uint16))
    assert bench.spin(lambda: len(heard['a']) == 4)
    assert c.depth_from_message(heard['a'][-1])[5, 5] == pytest.approx(0.7)


def test_cameras_that_return_bring_no_old_frames(bench):
    node, raw, heard = start(bench, 'a', 'b', camera_timeout_s=0.3, fuse_frames=5)
    standing(bench, raw)
    clock = Clock()
    run(bench, clock, raw, sets=6)
    assert run(bench, clock, raw[:1], lambda: 'b' in node.work.assembly.sets.lost)
    assert run(bench, clock, raw, lambda: 'b' not in node.work.assembly.sets.lost)
    assert len(node.work.assembly.frames['b']._fusion) <= 2


def test_infos_are_not_needed_with_every_image(bench):
    node, (raw,), heard = start(bench, 'a')
    standing(bench, [raw])
    raw.infos.publish(c.camera_info_message(raw.camera, c.header(S, 'a_optical')))
    for i in range(4):
        raw.send((i + 1) * S, info=False)
        bench.rest(0.05)
    assert bench.spin(lambda: len(heard['a']) >= 3)
    assert isinstance(node.work.inputs[0]._last_info, CameraInfo)


def test_frames_that_are_passed_over_are_reported_only_while_no_set_comes_together(bench):
    node, raw, heard = start(bench, 'a', 'b', camera_timeout_s=0.0)
    standing(bench, raw)

    def send(*offsets_ms):
        """Send images of a, b, a, ... at these times."""
        for i, offset in enumerate(offsets_ms):
            stamp = S + offset * 10 ** 6
            raw[i % 2].send(stamp)
            # Topics overtake each other: the next one is sent when this one has arrived.
            last = node.work.assembly.sets._last_stamp
            assert bench.spin(lambda: last.get('ab'[i % 2]) == stamp)

    def dropped():
        return sum(n for (_, reason), n in node.work.assembly.sets.drops.items()
                   if reason == 'spread')

    for cycle in range(12):
        send(*(1000 * cycle + ms for ms in (0, 120, 200)))      # 5 Hz, 120 ms apart
        assert bench.spin(lambda: len(heard['a']) == cycle + 1)
    assert dropped() == 12
    assert 'spread' not in {code for _, code in node.diagnostics._logged}
    send(*(20_000 + 120 * i for i in range(20)))
    assert dropped() > 22
    assert 'spread' in {code for _, code in node.diagnostics._logged}
    assert 'max_set_spread_s' in ' '.join(bench.reasons(node)[name][1] for name in 'ab')

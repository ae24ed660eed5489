# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Bags with one fault each: the doctor must name it, and must be silent about a sound bag."""

from types import SimpleNamespace

from hooc_perception.cli.main import main
from hooc_perception.core.geometry import rays
from hooc_perception.core.render import render_depth
from hooc_perception.core.types import Camera, DepthView
from hooc_perception.diagnosis.bag import check_bag
from hooc_perception.diagnosis.finding import ERROR, OK, WARNING, worst
from hooc_perception.io.bags.files import iter_messages, topics
from hooc_perception.io.bags.writer import STORAGES, TYPES, write_bag
import numpy as np
import pytest
from rosbags.interfaces import QosDurability
from rosbags.rosbag2 import Writer
import trimesh


def camera_above(name, azimuth):
    """Return a Camera one metre away that looks down at the origin from `azimuth` (rad)."""
    eye = np.array([0.8 * np.cos(azimuth), 0.8 * np.sin(azimuth), 0.8])
    forward = -eye / np.linalg.norm(eye)
    right = np.cross(forward, [0, 0, 1.0])
    right /= np.linalg.norm(right)
    T_world_camera = np.eye(4)
    T_world_camera[:3] = np.column_stack([right, np.cross(forward, right), forward, eye])
    K = np.array([[180, 0, 79.5], [0, 180, 59.5], [0, 0, 1.0]])
    return Camera(name, 160, 120, K, np.zeros(5), T_world_camera)


def depth_of(camera):
    """Return the (H, W) depth of a table with a box on it."""
    box = trimesh.creation.box((0.2, 0.15, 0.2))
    depth = render_depth([(box.vertices + [0, 0, 0.1], box.faces.astype(np.int32))], camera)[0]
    T = camera.T_world_camera
    table = -T[2, 3] / (rays(camera.K, camera.height, camera.width) @ T[2, :3])
    return np.where(table > 0, np.minimum(depth, table), np.nan).astype(np.float32)


@pytest.fixture(scope='module')
def sound(tmp_path_factory):
    """Return the path of a bag that nothing is wrong with: three cameras, three frame sets."""
    cameras = tuple(camera_above(f'camera{i}', i * 2.1) for i in range(3))
    scene = SimpleNamespace(
        name='sound', cameras=cameras, truth=None, world={}, depth_units=(0.001,) * 3,
        labels=lambda: None, depth=lambda: tuple(DepthView(c, depth_of(c)) for c in cameras))
    scene_set = SimpleNamespace(name='test', world_frame='table', category_names=('box',),
                                max_instances=1)
    return write_bag(scene, scene_set, tmp_path_factory.mktemp('bags'), repeat=3)


def rewritten(source, target, edit=lambda topic, message, i: message, latched=True):
    """
    Copy a bag message by message through `edit(topic, message, i) -> message or None`.

    :param i: how many messages of that topic came before.
    :param latched: False writes all topics volatile.
    """
    known = topics(source)
    with Writer(target, version=9, storage_plugin=STORAGES['mcap']) as writer:
        profiles = offered(source)
        if not latched:
            profiles = {name: [p._replace(durability=QosDurability.VOLATILE) for p in rows]
                        for name, rows in profiles.items()}
        connections, counts = {}, dict.fromkeys(known, 0)
        for entry in iter_messages(source):
            name, kind = entry.topic.name, entry.topic.type_name
            message = edit(name, entry.read(source), counts[name])
            counts[name] += 1
            if message is None:
                continue
            if name not in connections:
                connections[name] = writer.add_connection(
                    name, kind, typestore=TYPES, offered_qos_profiles=profiles[name])
            writer.write(connections[name], entry.time_ns, TYPES.serialize_cdr(message, kind))
    return target


def offered(source):
    """Return {topic: its QoS profiles}."""
    from rosbags.rosbag2 import Reader
    with Reader(source) as reader:
        return {c.topic: list(c.ext.offered_qos_profiles) for c in reader.connections}


def found(path, level):
    """Return the sentences of one level, joined."""
    return '\n'.join(f'{f.subject}: {f.text}' for f in check_bag(path) if f.level == level)


def test_a_sound_bag_is_called_sound(sound):
    findings = list(check_bag(sound))
    assert worst(findings) == OK, findings
    assert {'camera0', 'camera1', 'camera2', 'frame sets', 'table'} <= {
        f.subject for f in findings}


def drop(name):
    """Return an edit that leaves a topic out."""
    return lambda topic, message, i: None if topic == name else message


def image_edit(change, camera='camera1'):
    """Return an edit that applies `change(image, i)` to one camera's depth images."""
    def edit(topic, message, i):
        if topic == f'/hooc/{camera}/depth/image_raw':
            change(message, i)
        return message
    return edit


def unstamped(image, i):
    """Take the stamp away."""
    image.header.stamp.sec = image.header.stamp.nanosec = 0


def late(image, i):
    """Shift the clock of the camera by five seconds."""
    image.header.stamp.sec += 5


def backwards(image, i):
    """Let time run backwards."""
    image.header.stamp.sec -= i


def blind(image, i):
    """Take every reading away."""
    image.data = np.zeros_like(image.data)


def nearly_blind(image, i):
    """Leave a tenth of the rows."""
    image.data = image.data.copy()
    image.data[image.step * 12:] = 0


def cut(image, i):
    """Cut the second image's data off."""
    if i == 1:
        image.data = image.data[:1000]


def colour(image, i):
    """Claim a colour encoding."""
    if i == 1:
        image.encoding = 'rgb8'


def metres_as_millimetres(image, i):
    """Publish millimetres as floating point numbers."""
    counts = image.data.view(np.uint16).astype(np.float32)
    image.data, image.step, image.encoding = counts.view(np.uint8), image.step * 2, '32FC1'


@pytest.mark.parametrize('edit, level, words', [
    (drop('/hooc/camera1/depth/camera_info'), ERROR, ['camera1', 'camera_info is missing']),
    (image_edit(unstamped), ERROR, ['camera1', 'no header stamps']),
    (image_edit(late), ERROR, ['camera1', 'synchronise the clocks']),
    (image_edit(backwards), WARNING, ['camera1', 'go back in time']),
    (image_edit(blind), ERROR, ['camera1', 'no reading at all']),
    (image_edit(nearly_blind), WARNING, ['camera1', 'of its pixels']),
    (image_edit(cut), ERROR, ['camera1', '1 of 3 images', 'needs']),
    (image_edit(colour), ERROR, ['camera1', "'rgb8'", '16UC1']),
    (image_edit(metres_as_millimetres), ERROR, ['camera1', '32FC1 seems to hold millimetres']),
])
def test_faults_of_one_camera(sound, tmp_path, edit, level, words):
    text = found(rewritten(sound, tmp_path / 'bag', edit), level)
    assert all(word in text for word in words), text


def test_sizes_that_disagree(sound, tmp_path):
    def edit(topic, message, i):
        if topic == '/hooc/camera2/depth/camera_info':
            message.width = 640
        return message
    text = found(rewritten(sound, tmp_path / 'bag', edit), ERROR)
    assert 'width 640' in text and '160 x 120' in text


def test_singular_calibration(sound, tmp_path):
    def edit(topic, message, i):
        if topic.endswith('camera0/depth/camera_info'):
            message.k = np.zeros(9)
        return message
    assert 'camera0' in found(rewritten(sound, tmp_path / 'bag', edit), ERROR)


def test_missing_extrinsics(sound, tmp_path):
    def edit(topic, message, i):
        if topic == '/tf_static':
            message.transforms = message.transforms[:2]
        return None if topic == '/hooc/camera2/extrinsics' else message
    text = found(rewritten(sound, tmp_path / 'bag', edit), ERROR)
    assert 'nothing connects camera camera2' in text


def transforms(topic, message):
    """Return the transforms of a message that holds any."""
    return getattr(message, 'transforms', None) or (
        [message] if topic.endswith('/extrinsics') else [])


def test_inverted_extrinsics(sound, tmp_path):
    assert 'below the table' in found(rewritten(sound, tmp_path / 'bag', raised(-1.6)), ERROR)


def test_extrinsics_that_miss_the_table(sound, tmp_path):
    def edit(topic, message, i):
        for stamped in transforms(topic, message):
            if stamped.child_frame_id.startswith('camera1'):
                stamped.transform.translation.z += 0.015
        return message
    text = found(rewritten(sound, tmp_path / 'bag', edit), WARNING)
    assert 'camera1: its pose is 15 mm' in text and 'camera0' not in text


def test_transforms_that_are_not_latched(sound, tmp_path):
    text = found(rewritten(sound, tmp_path / 'bag', latched=False), WARNING)
    assert '/tf_static was recorded without transient-local' in text


def test_no_depth_at_all(sound, tmp_path):
    def edit(topic, message, i):
        return None if topic.endswith('image_raw') else message
    assert 'no depth topic' in found(rewritten(sound, tmp_path / 'bag', edit), ERROR)


SPEAKS_OF_IT = {'/hooc/camera2/depth/camera_info', '/hooc/camera2/extrinsics',
                '/hooc/scene_info'}


@pytest.mark.parametrize('kept', [SPEAKS_OF_IT, *({name} for name in sorted(SPEAKS_OF_IT))])
def test_a_camera_without_images_is_missed(sound, tmp_path, kept):
    gone = {'/hooc/camera2/depth/image_raw', *SPEAKS_OF_IT} - kept
    bag = rewritten(sound, tmp_path / 'bag',
                    lambda topic, message, i: None if topic in gone else message)
    text = found(bag, WARNING)
    assert 'no depth image of camera2' in text and 'only camera0, camera1' in text
    assert not found(bag, ERROR)


@pytest.mark.parametrize('command', ['run', 'replay'])
def test_commands_warn_of_a_camera_without_images(sound, tmp_path, command, monkeypatch, capsys,
                                                  repository):
    from hooc_perception.errors import HoocError
    pytest.importorskip('rclpy')
    model = repository / 'models' / 'demo'
    if not (model / 'model.json').is_file():
        pytest.skip('no bundled model')

    def enough(*args, **kwargs):
        raise HoocError('enough')

    monkeypatch.setattr('hooc_perception.cli.run.play', enough)
    monkeypatch.setattr('hooc_perception.supervisor.supervisor.Supervisor', enough)
    bag = rewritten(sound, tmp_path / 'bag', drop('/hooc/camera2/depth/image_raw'))
    for path, warned in ((bag, True), (sound, False)):
        assert main([command, str(path), *(
            ['--model', str(model), '--out', 'o.json'] if command == 'run' else [])]) == 1
        printed = capsys.readouterr().err
        assert ('warning: ' in printed and 'camera2' in printed) == warned
        assert 'enough' in printed


def test_truncated_file(sound, tmp_path):
    folder = rewritten(sound, tmp_path / 'bag')
    storage = next(folder.glob('*.mcap'))
    storage.write_bytes(storage.read_bytes()[:-20000])
    assert 'truncated' in found(folder, ERROR)
    assert 'can still be read; save them' in found(folder, WARNING)


def test_a_damaged_bag_is_salvaged_and_checked_again(sound, tmp_path, capsys):
    folder = rewritten(sound, tmp_path / 'bag')
    storage = next(folder.glob('*.mcap'))
    storage.write_bytes(storage.read_bytes()[:-20000])
    (folder / 'metadata.yaml').unlink()
    out = tmp_path / 'saved'
    assert main(['doctor', str(folder), '--salvage', str(out)]) == 0
    printed = capsys.readouterr().out
    assert 'messages recovered' in printed and '0 errors' in printed
    assert len(list(iter_messages(out))) > 10
    assert main(['doctor', str(folder), str(sound), '--salvage', str(out)]) == 1
    storage.write_bytes(b'')
    assert main(['doctor', str(folder), '--salvage', str(tmp_path / 'none')]) == 1
    assert 'no message can be read' in ''.join(capsys.readouterr())


@pytest.mark.parametrize('cameras, word', [(3, 'can be used'), (2, 'trained for 2 cameras')])
def test_models_that_do_not_fit_the_rig(sound, cameras, word):
    from hooc_perception.core.classification.classify import KIND_PAPER
    from hooc_perception.diagnosis.geometry import check_rig
    model = SimpleNamespace(name='m', classifier={'kind': np.array(KIND_PAPER)}, cameras=tuple(
        camera_above(f'camera{i}', i * 2.1) for i in range(cameras)))
    (finding,) = check_rig(sound, model)
    assert word in finding.text and finding.level == (OK if cameras == 3 else WARNING)


@pytest.mark.parametrize('seconds, word', [(-100, '100 s before'), (7, '7 s after')])
def test_clocks_that_are_off(sound, tmp_path, seconds, word):
    def edit(topic, message, i):
        if '/depth/' in topic:
            message.header.stamp.sec += seconds
        return message
    text = found(rewritten(sound, tmp_path / 'bag', edit), WARNING)
    assert word in text and 'synchronise' in text


def scaled(factor):
    """Return an edit that multiplies all depth."""
    def edit(topic, message, i):
        if topic.endswith('image_raw'):
            message.data = np.rint(message.data.view('<u2') * factor).astype('<u2').view(np.uint8)
        return message
    return edit


@pytest.mark.parametrize('factor, words', [
    (0.25, ['4 times as large', '0.004 m']), (0.1, ['10 times as large', '0.01 m']),
    (0.5, ['2 times as large']), (2.0, ['0.5 times as large', '0.0005 m'])])
def test_units_that_only_the_table_gives_away(sound, tmp_path, factor, words):
    text = found(rewritten(sound, tmp_path / 'bag', scaled(factor)), ERROR)
    assert all(word in text for word in (*words, 'image_raw', 'hooc.yaml')), text


def raised(height):
    """Return an edit that raises all cameras."""
    def edit(topic, message, i):
        for stamped in transforms(topic, message):
            stamped.transform.translation.z += height
        return message
    return edit


@pytest.mark.parametrize('height', [0.75, -0.3])
def test_a_table_frame_that_is_not_on_the_table(sound, tmp_path, height):
    bag = rewritten(sound, tmp_path / 'bag', raised(height))
    text = found(bag, ERROR)
    assert f'z = {height:.2f} m' in text or f'z = {height + 0.01:.2f} m' in text, text
    assert 'z = 0 is the table top' in text
    # What nobody has measured is not printed as a measurement.
    assert 'scatter' not in '\n'.join(f.text for f in check_bag(bag))


def test_hooc_run_refuses_a_bag_without_table_before_it_starts_nodes(sound, tmp_path, capsys,
                                                                   repository, monkeypatch):
    monkeypatch.setattr('hooc_perception.cli.run.play', lambda *args: pytest.fail('started'))
    bag = rewritten(sound, tmp_path / 'bag', raised(0.75))
    assert main(['run', str(bag), '--model', str(repository / 'models/demo'), '--out',
                 str(tmp_path / 'o.json')]) == 1
    assert f'{bag}: camera camera0' in capsys.readouterr().err


def test_stamps_of_a_simulator(sound, tmp_path):
    def edit(topic, message, i):
        if '/depth/' in topic:
            message.header.stamp.sec = 12 + i
        return message
    text = found(rewritten(sound, tmp_path / 'bag', edit), WARNING)
    assert 'use_sim_time' in text and 'synchronise' not in text


@pytest.mark.parametrize('change, words', [
    ({'k': np.array([360, 0, 159, 0, 360, 119, 0, 0, 1.0])}, ['principal point', '160 x 120']),
    ({'d': np.array([-1385.2, 842.6, 3120.5, -77.1, 12.9])}, ['camera0', 'no lens']),
    ({'distortion_model': 'equidistant'}, ['camera0', 'equidistant'])])
def test_calibrations_that_cannot_be_meant(sound, tmp_path, change, words):
    def edit(topic, message, i):
        if topic.endswith('camera0/depth/camera_info'):
            vars(message).update(change)
        return message
    text = found(rewritten(sound, tmp_path / 'bag', edit), ERROR)
    assert all(word in text for word in words), text


def test_metres_in_whole_numbers(sound, tmp_path):
    def edit(topic, message, i):
        if topic.endswith('image_raw'):
            metres = np.rint(message.data.view('<u2') / 1000).astype('<u2')
            message.data = metres.view(np.uint8)
        return message
    assert 'seems to hold metres' in found(rewritten(sound, tmp_path / 'bag', edit), ERROR)


def test_missing_bag_and_exit_codes(sound, tmp_path, capsys):
    assert main(['doctor', str(sound)]) == 0
    assert '0 errors' in capsys.readouterr().out
    assert main(['doctor', str(tmp_path / 'nowhere')]) == 1
    assert 'there is no such bag' in capsys.readouterr().out


def test_a_camera_that_ends_before_the_others_is_named(sound, tmp_path):
    cut = rewritten(sound, tmp_path / 'cut', lambda topic, message, i: (
        None if i and topic == '/hooc/camera1/depth/image_raw' else message))
    assert 'camera1: its images end 0.2 s before those of camera0' in found(cut, WARNING)

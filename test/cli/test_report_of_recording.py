# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""`hooc report` of a recording: what the nodes said, read from an MCAP file."""

import json
import re

from hooc_perception.cli.main import main
from hooc_perception.core.types import Candidates, Energy, ParsedScene
from hooc_perception.errors import HoocError
from hooc_perception.io.bags.bag_format import IMAGE, STRING, TYPES
from hooc_perception.io.bags.files import iter_messages
from hooc_perception.io.bags.raw_writer import RawBagWriter
from hooc_perception.io.bags.reader import BagScene
from hooc_perception.trained.folder import load_model_folder
import numpy as np
import pytest

pytest.importorskip('rclpy')

START_NS, STEP_NS = 1_700_000_000_000_000_000, 500_000_000
# Ids of each frame set: the second object is taken before the last one.
IDS = ((1, 2), (1, 2), (1,))


@pytest.fixture(scope='module')
def model(repository):
    return load_model_folder(repository / 'models' / 'demo')


@pytest.fixture(scope='module')
def record(repository, model):
    """Return a function that records the bundled scene as three frame sets with results."""
    bag = BagScene(repository / 'bags' / 'demo')
    truth = [t for t in bag.truth if t.category in [m.name for m in model.models]][:2]

    def write(path, ids=IDS, leave_out=(), info=None):
        with RawBagWriter(path) as writer:
            def add(topic, type_name, data, at_ns, latched=False):
                if not topic.endswith(tuple(leave_out)):
                    writer.write(topic, type_name, bytes(data), at_ns, latched)

            for message in iter_messages(bag.path):
                kind, content = message.topic.type_name, message.read(bag.path)
                if kind == STRING:
                    content.data = json.dumps(json.loads(content.data) | (info or {}))
                for k in range(len(ids) if kind == IMAGE else 1):
                    if kind == IMAGE:
                        stamp(content, k)
                    add(message.topic.name, kind, TYPES.serialize_cdr(content, kind),
                        START_NS + k * STEP_NS, kind == STRING)
            for k, numbers in enumerate(ids):
                for topic, kind, data in answers(k, numbers, truth[:len(numbers)], model):
                    add(f'/hooc/{topic}', kind, data, START_NS + k * STEP_NS + 1000)
        return path
    return write


def stamp(content, k):
    sec, content.header.stamp.nanosec = divmod(START_NS + k * STEP_NS, 10 ** 9)
    content.header.stamp.sec = sec


def answers(k, ids, objects, model):
    """Yield (topic, type, CDR) of what the nodes say of frame set k."""
    from hooc_perception.nodes.model import mesh_uris
    from hooc_perception.ros.messages.conversions import header
    from hooc_perception.ros.messages.stages import labels_json, objects_messages
    from rclpy.serialization import serialize_message
    from std_msgs.msg import String
    names = [m.name for m in model.models]
    n = len(objects)
    found = Candidates(np.array([names.index(o.category) + 1 for o in objects], np.uint16),
                       np.array([o.translation for o in objects]).reshape(-1, 3),
                       np.array([o.rotation_xyzw for o in objects]).reshape(-1, 4),
                       np.array([o.size for o in objects], np.float32).reshape(-1, 3),
                       np.full(n, 0.9, np.float32))
    parsed = ParsedScene(found, Energy(0, 0, 0), np.ones(n), np.zeros(n), np.zeros(n),
                         np.full(n, 3, np.uint8), found)
    stamp_ns = START_NS + k * STEP_NS
    poses, attributes = objects_messages(parsed, ids, 0.1, header(stamp_ns, 'table'))
    yield 'objects/poses', 'geometry_msgs/msg/PoseArray', serialize_message(poses)
    yield 'objects/attributes', 'sensor_msgs/msg/PointCloud2', serialize_message(attributes)
    yield 'objects/labels', STRING, serialize_message(String(data=labels_json(
        model.models, mesh_uris(model), ids, found)))
    if k == 2:
        event = {'event': 'taken', 'id': 2, 'category': 'x_y', 'translation': [0, 0, 0.1]}
        yield 'objects/events', STRING, serialize_message(String(data=json.dumps(
            {'format': 'hooc-events/1', 'stamp_ns': stamp_ns, 'events': [event]})))


def reported(path, page, *more):
    """Return (text of the page, data of its first 3D view)."""
    assert main(['report', str(path), '--out', str(page), *more]) == 0
    html = page.read_text()
    return html, json.loads(re.search(
        r'<script type="application/json">(.*?)</script>', html, re.S)[1])


def test_a_recording_opens_with_a_slider(record, tmp_path):
    path = record(tmp_path / 'live')
    assert [file.suffix for file in sorted(path.iterdir())] == ['.mcap', '.yaml']
    html, space = reported(path, tmp_path / 'r.html')
    assert 'max="3"' in html
    assert [tuple(o['id'] for o in step['objects']) for step in space['steps']] == list(IDS)
    assert 'stamp 1700000000.500000000 s · +0.50 s' in html
    assert html.count('<b>taken</b>') == 1 and html.count('no event') == 2
    # The truth of the bundled scene is that of every frame set.
    truth = BagScene(path).truth
    assert all(len(step['truth']) == len(truth) for step in space['steps'])
    assert html.count('verdict v-ok') == 5
    # The objects stand in the measured points: these are explained by them.
    explained = [sum(g['n'] for g in step['cloud']['groups'] if g['kind'] == 'explained')
                 for step in space['steps']]
    assert min(explained) > 50 and explained[0] > explained[2]


def test_the_mcap_file_alone_opens_too(record, tmp_path):
    path = record(tmp_path / 'live')
    assert reported(path / 'live.mcap', tmp_path / 'r.html')[1]['steps'][2]['objects']


def test_a_played_sequence_keeps_its_names_and_truths(record, tmp_path, repository):
    truth = json.loads(next(m for m in iter_messages(repository / 'bags' / 'demo')
                            if m.topic.type_name == STRING).read('').data)['truth']
    told = {'truth': None, 'sequence': {
        'period_s': 0.5, 'events': {'2': f'removed {truth[1]["category"]}'},
        'frame_sets': [{'scene': name, 'truth': truth[:n]}
                       for name, n in (('a', 2), ('b', 2), ('c', 1))]}}
    path = record(tmp_path / 'live', info=told)
    html, space = reported(path, tmp_path / 'r.html')
    assert [len(step['truth']) for step in space['steps']] == [2, 2, 1]
    assert 'frame set 3 of 3 · c ·' in html and 'Known: removed' in html
    html, space = reported(path, tmp_path / 'r.html', '--scene', 'b')
    assert 'type="range"' not in html and len(space['steps']) == 1
    assert main(['report', str(path), '--out', str(tmp_path / 'r.html'), '--scene', 'x']) == 1


def test_without_events_or_with_one_frame_set_it_still_opens(record, tmp_path):
    html, space = reported(record(tmp_path / 'a', leave_out=['objects/events']),
                           tmp_path / 'r.html')
    assert 'class="events"' not in html and len(space['steps']) == 3
    html, space = reported(record(tmp_path / 'b', IDS[:1]), tmp_path / 'r.html')
    assert 'type="range"' not in html and len(space['steps']) == 1


def test_results_without_their_images_are_left_out(record, tmp_path):
    from hooc_perception.supervisor.recorded import recorded_results
    path = record(tmp_path / 'live')
    late = tmp_path / 'late'
    # A recorder that started after the first frame set has its latched result, too.
    with RawBagWriter(late) as writer:
        for message in iter_messages(path):
            if message.topic.type_name != IMAGE or message.time_ns > START_NS:
                writer.write(message.topic.name, message.topic.type_name, message.data,
                             message.time_ns, message.topic.latched)
    results = recorded_results(late).results
    assert [r.stamp_ns for r in results] == [START_NS + STEP_NS, START_NS + 2 * STEP_NS]
    assert [set(r.images.values()) for r in results] == [{0}, {1}]
    assert results[0].seconds == pytest.approx(1e-6)


def test_recordings_that_cannot_be_shown_say_why(record, tmp_path, capsys, repository):
    from hooc_perception.supervisor.recorded import recorded_results
    with pytest.raises(HoocError, match='holds no results .*; record them'):
        recorded_results(repository / 'bags' / 'demo')
    path = record(tmp_path / 'live', leave_out=['objects/labels'])
    assert main(['report', str(path), '--out', str(tmp_path / 'r.html')]) == 1
    assert 'give the model folder with --model' in capsys.readouterr().err
    assert reported(path, tmp_path / 'r.html', '--model',
                    str(repository / 'models' / 'demo'))[1]['steps']
    path = record(tmp_path / 'late', leave_out=['depth/image_raw'])
    with pytest.raises(HoocError):
        recorded_results(path)

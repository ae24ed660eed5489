# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
The bundled scene through five real processes: the same objects as in one process.

One start of the nodes serves all that is looked at here.
"""

import json
import os
from pathlib import Path
import subprocess
import sys

import numpy as np
import pytest

pytest.importorskip('rclpy')

HERE = Path(__file__).parent
SEED = 4


@pytest.fixture(scope='module')
def bundle(request):
    """Return (bag path, model path) of the bundled scene."""
    root = request.config.rootpath
    bag, model = root / 'bags' / 'demo', root / 'models' / 'demo'
    if not (bag / 'metadata.yaml').is_file() or not (model / 'model.json').is_file():
        pytest.skip('no bundled scene: make it with "make bundle"')
    return bag, model


@pytest.fixture(scope='module')
def played(bundle, tmp_path_factory):
    """Return (Answer, Answer of a second play, prints of two late subscribers, recording)."""
    from hooc_perception.chain import CHAIN, REPLAY
    from hooc_perception.io.bags.reader import BagScene
    from hooc_perception.supervisor import environment
    from hooc_perception.supervisor.bags import BagRunner
    from hooc_perception.supervisor.supervisor import Supervisor
    from hooc_perception.trained.folder import load_model_folder
    bag, model = bundle
    before = dict(os.environ)
    for name in ('ROS_DOMAIN_ID', *environment.FAST_DDS_VARIABLES):
        os.environ.pop(name, None)
    stage = {'model': str(model), 'profile': 'fast', 'seed': SEED}
    parameters = {name: dict(stage) for name in CHAIN}
    parameters['ingestion_node']['max_frame_age_s'] = 0.0
    try:
        with Supervisor((*CHAIN, REPLAY), parameters, isolated=True) as supervisor:
            runner = BagRunner(supervisor, 240.0)
            first = runner.play(BagScene(bag))
            # No `hooc`, no package of ours: only the environment that says which domain.
            late = subprocess.Popen([sys.executable, '-I', str(HERE / 'late_subscriber.py')],
                                    stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
            surest = int(first.parsed.objects.score.argmax())
            example = subprocess.Popen(
                [sys.executable, '-I', str(HERE.parents[1] / 'examples' / 'pick_target.py'),
                 load_model_folder(model).models[first.parsed.objects.category[surest] - 1].name,
                 '--score', '0', '--max-age', '600'],
                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
            for process in (late, example):
                supervisor.wait(lambda p=process: p.poll() is not None, 60.0, 'it does not end')
            runner._record = tmp_path_factory.mktemp('bags') / 'out'
            second = runner.play(BagScene(bag))
    finally:
        os.environ.clear()
        os.environ.update(before)
    return (first, second, late.stdout.read(), example.stdout.read(),
            runner._record / BagScene(bag).name)


def test_nodes_and_one_process_find_the_same_objects(bundle, played):
    from hooc_perception.io.bags.reader import BagScene
    from hooc_perception.parser import Parser
    from hooc_perception.trained.folder import load_model_folder
    scene, model = BagScene(bundle[0]), load_model_folder(bundle[1])
    parser = Parser.load(model, 'fast', max_instances=scene.info['max_instances'], sigmas=False)
    alone = parser.parse(scene.views(), SEED).parsed
    assert len(alone.objects) > 0
    for answer in played[:2]:
        # The topics carry the first proposals; those of later rounds come behind them.
        first = np.arange(len(answer.parsed.pool))
        assert 0 < len(first) <= len(alone.pool)
        for mine, theirs in ((answer.parsed.objects, alone.objects),
                             (answer.parsed.pool, alone.pool.take(first))):
            for name in ('category', 'translation', 'rotation_xyzw', 'size', 'score'):
                a, b = getattr(mine, name), getattr(theirs, name)
                assert a.dtype == b.dtype and a.shape == b.shape
                assert a.tobytes() == b.tobytes(), name
        for name in ('visible_ratio', 'residual_m', 'energy_delta', 'n_views'):
            np.testing.assert_array_equal(getattr(answer.parsed, name), getattr(alone, name))
        assert answer.parsed.energy == alone.energy


def test_the_answer_has_a_duration(played):
    assert all(0 < answer.seconds < 60 for answer in played[:2])
    assert played[1].stamp_ns > played[0].stamp_ns


def test_a_late_subscriber_can_name_every_object(bundle, played):
    from hooc_perception.trained.folder import load_model_folder
    names = [m.name for m in load_model_folder(bundle[1]).models]
    *lines, last = played[2].strip().splitlines()
    assert last == 'done table'
    told = [json.loads(line) for line in lines]
    found = played[0].parsed.objects
    assert [t['name'] for t in told] == [names[c - 1] for c in found.category]
    np.testing.assert_array_equal([t['translation'] for t in told], found.translation)
    np.testing.assert_array_equal(np.float32([t['size'] for t in told]), found.size)
    assert np.isfinite([t['score'] for t in told]).all()


def test_the_example_of_a_planner_waits_above_the_surest_object(played):
    target, found = json.loads(played[3]), played[0].parsed.objects
    surest = int(found.score.argmax())
    np.testing.assert_allclose(target['position'][:2], found.translation[surest, :2], atol=1e-6)
    above = target['position'][2] - found.translation[surest, 2]
    assert 0.1 < above < 0.1 + found.size[surest].max()
    assert target['frame'] == 'table' and target['score'] == pytest.approx(found.score[surest])


def test_a_recording_holds_the_answer_and_is_a_bag_like_any_other(bundle, played):
    from hooc_perception.io.bags.reader import BagScene
    from mcap.reader import make_reader
    from rosbags.typesys import get_typestore, Stores
    store, last, counts = get_typestore(Stores.ROS2_JAZZY), {}, {}
    file, = played[4].glob('*.mcap')
    with open(file, 'rb') as stream:
        for schema, channel, message in make_reader(stream).iter_messages():
            counts[channel.topic] = counts.get(channel.topic, 0) + 1
            last[channel.topic] = store.deserialize_cdr(message.data, schema.name)
    found = played[1].parsed.objects
    assert counts['/hooc/objects/poses'] == 1       # not what was latched of the scene before
    poses = last['/hooc/objects/poses'].poses
    np.testing.assert_array_equal(
        [(p.position.x, p.position.y, p.position.z) for p in poses], found.translation)
    assert last['/hooc/objects/attributes'].width == len(found)
    assert json.loads(last['/hooc/scene/summary'].data)['stamp_ns'] == played[1].stamp_ns
    for topic in ('pixels/probabilities', 'candidates/poses', 'objects/markers',
                  'objects/labels', 'scene/unexplained'):
        assert f'/hooc/{topic}' in counts, topic
    for mine, theirs in zip(BagScene(played[4]).views(), BagScene(bundle[0]).views()):
        np.testing.assert_array_equal(mine.depth, theirs.depth)

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
The four nodes of the chain with stages that only look at what they are given.

What arrives in a stage after all the topics is what the one-process chain would have given it,
to the last bit; and what the last stage answers comes out as promised.
"""

from dataclasses import replace
import json

from hooc_perception.core.frame.frame import Frame
from hooc_perception.core.geometry import matrix_from_pose, pose_from_matrix
from hooc_perception.core.segment.observe import observe
from hooc_perception.core.segment.rectify import rectify
from hooc_perception.core.types import DepthView
import numpy as np
import pytest

pytest.importorskip('rclpy')

from geometry_msgs.msg import PolygonStamped, PoseArray  # noqa: E402
from hooc_perception.nodes import parsing_node
from hooc_perception.nodes.warm_up import overhead_camera
from hooc_perception.parser import Parser
from hooc_perception.ros.messages import conversions as c
from hooc_perception.ros.messages.point_clouds import cloud_rows
from hooc_perception.ros.messages.stages import candidates_from_messages
from hooc_perception.ros.qos import qos
from rclpy.lifecycle import TransitionCallbackReturn  # noqa: E402
from rclpy.parameter import Parameter  # noqa: E402
from sensor_msgs.msg import PointCloud2  # noqa: E402
from std_msgs.msg import String  # noqa: E402
from std_srvs.srv import SetBool, Trigger  # noqa: E402
from visualization_msgs.msg import Marker, MarkerArray  # noqa: E402

SEED = 5    # of make_chain
# Well below the 30 s after which detect gives up.
AT_ONCE_S = 10.0


def heard_answer(bench, stages):
    """Return lists of the messages on the answer's topics, from now on."""
    kinds = {'objects/poses': PoseArray, 'objects/attributes': PointCloud2,
             'objects/labels': String, 'objects/markers': MarkerArray, 'scene/summary': String,
             'scene/unexplained': PointCloud2, 'objects/can/poses': PoseArray,
             'objects/ball/poses': PoseArray, 'objects/unknown': PoseArray,
             'objects/unknown_attributes': PointCloud2}
    return {topic: bench.hear(kind, topic, qos(topic if topic.count('/') == 1
                                               else 'objects/<category>/poses'))
            for topic, kind in kinds.items()}


def same_bits(a, b):
    """Compare arrays, records and tuples of them to the last bit."""
    if isinstance(a, (tuple, list)):
        assert len(a) == len(b)
        for x, y in zip(a, b):
            same_bits(x, y)
    elif hasattr(a, '__dataclass_fields__'):
        for name in a.__dataclass_fields__:
            same_bits(getattr(a, name), getattr(b, name))
    elif isinstance(a, np.ndarray):
        assert a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()
    else:
        assert a == b


def test_stages_get_what_the_one_process_chain_gives_them(chain, folder):
    stages, bench, send = chain
    send()
    assert bench.spin(lambda: 'parse' in stages.given)
    view = DepthView(overhead_camera(), stages.views[0].depth)
    expected = observe([rectify(view)])
    for stage in ('classify', 'propose', 'parse'):
        same_bits(stages.given[stage][0], expected)
    same_bits(stages.given['propose'][1], stages.p)
    same_bits(stages.given['parse'][1], stages.p)
    pool = stages.propose(Frame(expected, stages.p, folder.models), SEED)
    same_bits(stages.given['parse'][2], pool)
    assert stages.given['propose'][3] == SEED
    assert stages.given['parse'][3:] == (SEED, 1)


def test_a_table_that_is_found_in_the_frame_of_a_robot(bench, make_chain):
    T = matrix_from_pose([0.6, -0.1, 0.72], [0, 0, np.sin(0.4), np.cos(0.4)])
    translation, rotation = pose_from_matrix(T @ overhead_camera().T_world_camera)
    own = {'target_frame': 'base_link', 'extrinsics.overhead': [*translation, *rotation]}
    stages, send = make_chain(parameters={
        0: {**own, 'observe.table': 'find', 'observe.workspace': '[[0.0, -0.7], [1.2, 0.5]]'},
        **{k: {'target_frame': 'base_link'} for k in (1, 2, 3)}})
    heard = heard_answer(bench, stages)
    tables = bench.hear(PolygonStamped, 'scene/table', qos('scene/table'))
    pixels = bench.hear(PointCloud2, 'pixels/probabilities', qos('pixels/probabilities'))
    send()
    assert bench.spin(lambda: all(heard.values()) and tables and pixels), (
        [bench.reasons(node) for node in bench.chain])
    observation, _, pool = stages.given['parse'][:3]
    found = observation.T_target_table
    np.testing.assert_allclose(found[:3, 3], T[:3, 3], atol=0.004)
    assert np.degrees(np.arccos(found[2, 2])) < 0.5
    # The stages work on the table, the answer is in the frame of the robot.
    np.testing.assert_allclose(pool.translation, stages.candidates.translation, atol=1e-6)
    answer = candidates_from_messages(heard['objects/poses'][-1],
                                      heard['objects/attributes'][-1])
    np.testing.assert_allclose(answer.translation, pool.moved(found).take([0, 2]).translation,
                               atol=1e-9)
    assert heard['objects/poses'][-1].header.frame_id == 'base_link'
    for rows in (cloud_rows(pixels[-1]), cloud_rows(heard['scene/unexplained'][-1])):
        assert len(rows) and 0.72 < np.median(rows['z']) < 0.95
    corners = [(p.x, p.y, p.z) for p in tables[-1].polygon.points]
    assert len(corners) >= 3 and tables[-1].header.frame_id == 'base_link'
    np.testing.assert_allclose(np.array(corners)[:, 2], 0.72, atol=0.006)
    status = next(s for s in bench.chain[0].diagnostics.statuses() if s.name.endswith(': table'))
    values = {v.key: v.value for v in status.values}
    assert float(values['height_m']) == pytest.approx(0.72, abs=0.004)


def test_parsing_proposes_again_as_the_one_process_chain_does(bench, make_chain, folder):
    own = {f'propose.{name}': value for name, value in {
        'round_samples': 300, 'round_pool': 5, 'refine_steps': 2, 'polish_steps': 2}.items()}
    stages, send = make_chain(parameters={3: own})
    stages.turns = 1, 2
    send()
    assert bench.spin(lambda: 'parse' in stages.given, 60.0)
    observation, probabilities, pool = stages.given['parse'][:3]
    alone = Parser.load(folder, parameters=own)
    expected = [alone.method.propose_more(alone.frame(observation, probabilities),
                                          pool.take(stages.chosen), turn, SEED)
                for turn in stages.turns]
    same_bits(stages.asked, expected)
    assert any(len(more) for more in expected), 'the ball was left out'


def test_the_answer_on_its_topics(chain, folder):
    stages, bench, send = chain
    heard = heard_answer(bench, stages)
    stamp = send()
    assert bench.spin(lambda: all(heard.values()))
    poses, attributes = heard['objects/poses'][-1], heard['objects/attributes'][-1]
    assert c.nanoseconds(poses.header.stamp) == stamp and poses.header.frame_id == 'table'
    given = stages.given['parse'][2].take(stages.chosen)
    answer = candidates_from_messages(poses, attributes)
    same_bits(replace(answer, score=given.score), given)
    assert ((0 < answer.score) & (answer.score < 1)).all()
    labels = json.loads(heard['objects/labels'][-1].data)
    assert [labels['classes'][str(i)]['name'] for i in (1, 2, 3)] == ['box', 'ball', 'can']
    rows = cloud_rows(attributes)
    assert (rows['sigma_t'] > 0).all() and (rows['sigma_r'] > 0).all()
    assert [labels['objects'][str(i)]['category'] for i in rows['id']] == ['box', 'can']
    assert 0 < rows['age_s'][0] < 60
    assert len(heard['objects/can/poses'][-1].poses) == 1
    assert len(heard['objects/ball/poses'][-1].poses) == 0
    summary = json.loads(heard['scene/summary'][-1].data)
    assert summary['stamp_ns'] == stamp and summary['energy']['total'] == 0.875
    # The ball was left out, so its surface is what remains unexplained.
    left = cloud_rows(heard['scene/unexplained'][-1])
    ball = stages.candidates.translation[1]
    away = np.hypot(left['x'] - ball[0], left['y'] - ball[1])
    assert len(left) > 20 and np.median(away) < 0.05
    markers = heard['objects/markers'][-1].markers
    # The ball was left out: something of no category stands there.
    assert [(m.ns, m.action) for m in markers] == [
        ('box', Marker.ADD), ('can', Marker.ADD), ('unknown', Marker.ADD)]
    assert len(heard['objects/unknown'][-1].poses) == 1
    unknown, = cloud_rows(heard['objects/unknown_attributes'][-1])
    away = np.hypot(unknown['x'] - ball[0], unknown['y'] - ball[1])
    assert away < 0.02 and unknown['id'] not in rows['id']
    assert markers[0].mesh_resource == folder.mesh_path('box').as_uri()
    assert markers[0].scale.x == pytest.approx(1.0, abs=1e-6)


def test_empty_tables_are_answers_and_markers_go(chain):
    stages, bench, send = chain
    heard = heard_answer(bench, stages)
    send()
    assert bench.spin(lambda: all(heard.values()))
    first = {(m.ns, m.id) for m in heard['objects/markers'][-1].markers}
    stages.chosen = []
    send()
    assert bench.spin(lambda: all(len(m) >= 2 for m in heard.values()))
    assert heard['objects/poses'][-1].poses == [] and heard['objects/attributes'][-1].width == 0
    markers = heard['objects/markers'][-1].markers
    # The ball, which was left out before, is still of no category; the others have joined it.
    assert {(m.ns, m.id) for m in markers if m.action == Marker.DELETE} == {
        key for key in first if key[0] != 'unknown'}
    assert {m.ns for m in markers if m.action == Marker.ADD} == {'unknown'}
    assert {('unknown', m.id) for m in markers if m.action == Marker.ADD} >= {
        key for key in first if key[0] == 'unknown'}
    assert heard['objects/can/poses'][-1].poses == []


def test_ids_stay_with_objects_until_they_are_reset(chain):
    stages, bench, send = chain
    heard = heard_answer(bench, stages)

    def ids(chosen):
        before = {topic: len(messages) for topic, messages in heard.items()}
        stages.chosen = chosen
        send()
        assert bench.spin(lambda: all(len(heard[topic]) > n for topic, n in before.items()))
        return cloud_rows(heard['objects/attributes'][-1])['id'].tolist()

    box, can = ids([0, 2])
    assert ids([2, 0]) == [can, box]
    # A viewer is told of what is gone, and of nothing else.
    assert [m.action for m in heard['objects/markers'][-1].markers] == [Marker.ADD] * 3
    assert ids([0]) == [box]
    gone = [m for m in heard['objects/markers'][-1].markers if m.action == Marker.DELETE]
    assert [(m.ns, m.id) for m in gone] == [('can', can)]
    assert ids([2]) == [can]
    labels = json.loads(heard['objects/labels'][-1].data)
    assert labels['objects'] == {str(can): {
        'category': 'can', 'class_id': 3, 'member': 0,
        **{key: labels['classes']['3'][key] for key in ('mesh', 'sha256')}}}
    assert bench.spin(call(bench, Trigger, 'reset').done)
    bench.rest(0.3)
    assert not {box, can} & set(ids([0, 2]))


def call(bench, kind, name, **fields):
    """Return the future of a service call."""
    client = bench.peer.create_client(kind, name)
    assert bench.spin(client.service_is_ready)
    return client.call_async(kind.Request(**fields))


def test_detect_answers_with_what_came_after_the_call(chain):
    stages, bench, send = chain
    heard = heard_answer(bench, stages)
    send()
    assert bench.spin(lambda: heard['objects/poses'])
    future = call(bench, Trigger, 'detect')
    bench.rest(0.5)
    assert not future.done(), 'answered with what was seen before the call'
    stamp = send()
    assert bench.spin(future.done)
    assert future.result().success
    answer = json.loads(future.result().message)
    assert answer['stamp_ns'] == stamp and answer['frame'] == 'table'
    assert [o['category'] for o in answer['objects']] == ['box', 'can']
    assert answer['objects'][0]['translation'] == (
        stages.given['parse'][2].translation[0].tolist())


def test_detect_gives_up(chain):
    stages, bench, send = chain
    assert bench.chain[3].set_parameters(
        [Parameter('detect_timeout_s', value=0.3)])[0].successful
    future = call(bench, Trigger, 'detect')
    assert bench.spin(future.done)
    assert not future.result().success and 'cameras' in future.result().message


def test_detect_gives_up_while_simulated_time_stands_still(chain):
    stages, bench, send = chain
    bench.chain[3].set_parameters([Parameter('detect_timeout_s', value=0.3),
                                   Parameter('use_sim_time', value=True)])
    future = call(bench, Trigger, 'detect')
    assert bench.spin(future.done) and not future.result().success


def test_detect_refuses_at_once_what_nobody_will_answer(chain):
    stages, bench, send = chain
    waiting = call(bench, Trigger, 'detect')
    bench.rest(0.2)
    assert bench.spin(call(bench, SetBool, 'enable', data=False).done)
    assert bench.spin(waiting.done) and 'ignored' in waiting.result().message
    future = call(bench, Trigger, 'detect')
    assert bench.spin(future.done, AT_ONCE_S)
    assert not future.result().success and 'enable' in future.result().message
    assert bench.spin(call(bench, SetBool, 'enable', data=True).done)
    waiting = call(bench, Trigger, 'detect')
    bench.rest(0.2)
    bench.chain[3].trigger_deactivate()
    assert bench.spin(waiting.done, AT_ONCE_S) and 'deactivated' in waiting.result().message
    assert bench.spin(call(bench, Trigger, 'detect').done, AT_ONCE_S)


def test_detect_survives_a_clock_that_is_set_back(chain):
    stages, bench, send = chain
    bench.chain[0].set_parameters([Parameter('max_frame_age_s', value=0.0)])
    heard = heard_answer(bench, stages)
    send()
    assert bench.spin(lambda: heard['objects/poses'])
    future = call(bench, Trigger, 'detect')
    bench.rest(0.2)
    send(-100.0)        # a bag that starts again
    assert bench.spin(future.done)
    assert future.result().success, future.result().message


@pytest.mark.parametrize('parameter, value, package', [
    ('publish_tf', True, 'tf2_msgs'), ('publish_detections', 'on', 'vision_msgs'),
    ('planning_scene', 'box', 'moveit_msgs')])
def test_packages_that_are_not_there_are_missed_when_configuring(bench, folder, parameter, value,
                                                                 package):
    try:
        __import__(f'{package}.msg')
        pytest.skip(f'{package} is installed')
    except ImportError:
        pass
    node = bench.add(parsing_node.ParsingNode, model=str(folder.path), warm_up=False,
                     **{parameter: value})
    assert node.trigger_configure() == TransitionCallbackReturn.FAILURE
    assert package in bench.reasons(node)['node'][1]


def test_enable_and_reset(chain):
    stages, bench, send = chain
    heard = heard_answer(bench, stages)
    future = call(bench, SetBool, 'enable', data=False)
    assert bench.spin(future.done) and future.result().success
    send()
    bench.rest(0.6)
    assert 'propose' in stages.given and 'parse' not in stages.given
    assert bench.reasons(bench.chain[3])['parse'][0] == 'disabled'
    assert bench.spin(call(bench, SetBool, 'enable', data=True).done)
    assert bench.reasons(bench.chain[3])['parse'][0] == 'waiting'
    send()
    assert bench.spin(lambda: heard['objects/poses'] and heard['objects/markers'])
    assert bench.spin(call(bench, Trigger, 'reset').done)
    assert bench.spin(lambda: heard['objects/markers'][-1].markers[-1].action == Marker.DELETEALL)
    # Who acts on the answer learns that it is void, in every form that it has.
    assert bench.spin(lambda: heard['objects/poses'][-1].poses == [])
    assert heard['objects/attributes'][-1].width == 0
    assert heard['objects/can/poses'][-1].poses == []
    assert heard['scene/unexplained'][-1].width == 0
    assert json.loads(heard['objects/labels'][-1].data)['objects'] == {}


def test_an_answer_that_nothing_follows_is_taken_back(chain):
    stages, bench, send = chain
    heard = heard_answer(bench, stages)
    parsing = bench.chain[3]
    parsing.set_parameters([Parameter('keep_answer_s', value=1.5)])
    send()
    assert bench.spin(lambda: heard['objects/poses'] and heard['objects/poses'][-1].poses)
    assert bench.spin(lambda: heard['objects/poses'][-1].poses == [])
    assert bench.spin(lambda: heard['objects/can/poses'][-1].poses == [])
    assert bench.reasons(parsing)['parse'][0] == 'answer_expired'
    n = len(heard['objects/poses'])
    bench.rest(1.2)
    assert len(heard['objects/poses']) == n, 'it is taken back once'


def test_the_model_and_the_stage_have_a_status_before_the_first_frame(chain):
    stages, bench, send = chain
    for node, stage in zip(bench.chain[1:], ('classify', 'propose', 'parse')):
        status = {s.name.partition(': ')[2]: s for s in node.diagnostics.statuses()}
        assert bench.reasons(node)[stage][0] == 'waiting' and status[stage].level == b'\0'
        values = {v.key: v.value for v in status['model'].values}
        assert values == {'reason': 'ok', 'name': 'm', 'profile': 'fast',
                          'categories': 'box, ball, can'}
    send()
    assert bench.spin(lambda: bench.reasons(bench.chain[3])['parse'][0] == 'ok')


def test_profile_and_overrides_give_the_stage_parameters(bench, folder):
    from hooc_perception.core.profiles import profile
    for name in ('paper', 'best', 'fast'):
        changed = {'draws' if name == 'paper' else 'round_samples': 300}
        node = bench.add(parsing_node.ParsingNode, profile=name,
                         **{f'propose.{key}': value for key, value in changed.items()})
        assert node.parameters['parse'] == profile(name).parse
        assert node.parameters['propose'] == replace(profile(name).propose, **changed)
    # Without the parameter, the model's own.
    node = bench.add(parsing_node.ParsingNode, model=str(folder.path))
    assert node.parameters['parse'] == profile('fast').parse

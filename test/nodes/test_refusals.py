# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Frame sets that a node of the chain does not answer: said why, and nobody waits for them."""

from hooc_perception.errors import HoocError
import pytest

pytest.importorskip('rclpy')

from geometry_msgs.msg import PoseArray  # noqa: E402
from hooc_perception.nodes import ingestion_node
from hooc_perception.nodes.replay_node import ReplayNode
from hooc_perception.ros.inputs import view_input
from hooc_perception.ros.messages.conversions import header, nanoseconds
from hooc_perception.ros.qos import qos
from std_msgs.msg import Header  # noqa: E402

# Who waits for an answer for so long has not been told.
LONG = {0: {'wait_for_answer_s': 600.0}}
NODES = ('classify', 'propose', 'parse')


@pytest.mark.parametrize('stage, error, thing', [
    ('classify', HoocError('the moon is too bright'), 'classify'),
    ('propose', ZeroDivisionError('a surprise'), 'input'),
    ('parse', HoocError('the moon is too bright'), 'parse')])
def test_after_a_refusal_the_next_set_is_parsed(bench, make_chain, stage, error, thing):
    stages, send = make_chain(parameters=LONG)
    answers = bench.hear(PoseArray, 'objects/poses', qos('objects/poses'))
    send()
    assert bench.spin(lambda: answers)
    node = bench.chain[1 + NODES.index(stage)]
    stages.refuse = stage, error
    send()
    assert bench.spin(lambda: str(error) in bench.reasons(node).get(thing, ' ')[1])
    # The last good answer stands: an empty one would say that nothing is there.
    assert len(answers) == 1 and len(answers[0].poses) == 2
    stages.refuse = None
    send()
    assert bench.spin(lambda: len(answers) == 2)


def test_an_inactive_node_is_named_and_the_chain_goes_on_with_it(bench, make_chain, monkeypatch):
    monkeypatch.setattr(view_input, 'EXPLAIN_AFTER_S', 0.1)
    stages, send = make_chain(parameters=LONG, active=(0, 1, 3))
    candidate, parsing = bench.chain[2:]
    assert bench.reasons(candidate)['node'][0] == 'not_active'
    answers = bench.hear(PoseArray, 'objects/poses', qos('objects/poses'))
    refused = bench.hear(Header, 'views/refused', qos('views/refused'))
    send()
    assert bench.spin(lambda: bench.reasons(parsing).get('input', [''])[0] == 'not_active')
    assert '/hooc/candidate_node, which is inactive' in bench.reasons(parsing)['input'][1]
    assert not refused, 'it is not asked for more while nothing can come of it'
    candidate.trigger_activate()
    assert bench.reasons(candidate)['node'][0] == 'ok'
    assert bench.spin(lambda: refused)
    send()
    assert bench.spin(lambda: answers)


def test_a_node_that_computes_is_not_taken_for_inactive(bench, make_chain, monkeypatch):
    monkeypatch.setattr(view_input, 'EXPLAIN_AFTER_S', 0.1)
    stages, send = make_chain(parameters=LONG)
    bench.executor.remove_node(bench.chain[2])
    send()
    assert bench.spin(lambda: 'classify' in stages.given)
    bench.rest(1.5)
    assert 'not_active' not in bench.reasons(bench.chain[3]).get('input', ())


@pytest.mark.parametrize('error, thing', [
    (HoocError('no table in sight'), 'views'), (ZeroDivisionError('a surprise'), 'input')])
def test_a_set_that_stage_1_cannot_use_is_refused_by_ingestion(bench, make_chain, monkeypatch,
                                                               error, thing):
    stages, send = make_chain(parameters=LONG)
    answers = bench.hear(PoseArray, 'objects/poses', qos('objects/poses'))
    refused = bench.hear(Header, 'views/refused', qos('views/refused'))

    def fail(*given):
        raise error
    with monkeypatch.context() as patch:
        patch.setattr(ingestion_node, 'observe', fail)
        stamp = send()
        assert bench.spin(lambda: refused)
    assert nanoseconds(refused[0].stamp) == stamp and refused[0].frame_id == 'table'
    assert str(error) in bench.reasons(bench.chain[0])[thing][1]
    assert not stages.given and not answers
    send()
    assert bench.spin(lambda: answers)


def test_views_of_another_frame_are_refused(bench, make_chain):
    stages, send = make_chain(parameters={3: {'target_frame': 'robot_base'}})
    answers = bench.hear(PoseArray, 'objects/poses', qos('objects/poses'))
    refused = bench.hear(Header, 'views/refused', qos('views/refused'))
    send()
    assert bench.spin(lambda: refused)
    code, sentence = bench.reasons(bench.chain[3])['views']
    assert code == 'refused' and "'table'" in sentence and "'robot_base'" in sentence
    assert 'target_frame' in sentence and not answers


def test_a_replay_that_waits_goes_on(bench, repository):
    bag = repository / 'bags' / 'demo'
    if not bag.is_dir():
        pytest.skip('no bundled scene: make it with "make bundle"')
    node = bench.add(ReplayNode, bag=str(bag), rate=0.0, loop=True,
                     answer_timeout_s=3600.0, wait_for_subscribers=0)
    refusals = bench.peer.create_publisher(Header, 'views/refused', qos('views/refused'))
    node.trigger_configure()
    node.trigger_activate()
    assert bench.spin(lambda: refusals.get_subscription_count() and node.work.player
                      and node.work.player.waits_for_release)
    refused = node.work.player.set_stamp_ns
    refusals.publish(header(refused - 1, 'table'))      # of an older set
    bench.rest(0.3)
    assert node.work.player.waits_for_release
    refusals.publish(header(refused, 'table'))
    assert bench.spin(lambda: node.work.player.set_stamp_ns > refused)

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Parsing asks for more candidates in the middle of its work and gets them unchanged."""

from dataclasses import replace
import threading
import time

from hooc_perception.core.types import Candidates
from hooc_perception.errors import HoocError
import numpy as np
import pytest

pytest.importorskip('rclpy')

from geometry_msgs.msg import PoseArray  # noqa: E402
from hooc_perception.nodes import candidate_node, parsing_node
from hooc_perception.ros import reproposal
from hooc_perception.ros.lifecycle.stage_node import StageConfig, StageNode
from hooc_perception.ros.messages.conversions import header
from hooc_perception.ros.messages.stages import candidates_messages
from hooc_perception.ros.qos import qos
from rclpy.executors import SingleThreadedExecutor  # noqa: E402
from sensor_msgs.msg import PointCloud2  # noqa: E402
from std_msgs.msg import String  # noqa: E402


def some(n, seed=0):
    rng = np.random.default_rng(seed)
    rotation = rng.normal(size=(n, 4))
    return Candidates(rng.integers(1, 9, n).astype(np.uint16), rng.normal(size=(n, 3)),
                      rotation / np.linalg.norm(rotation, axis=1)[:, None],
                      rng.random((n, 3), np.float32), rng.random(n, np.float32))


def same(a, b):
    for name in ('category', 'translation', 'rotation_xyzw', 'size', 'score'):
        mine, theirs = getattr(a, name), getattr(b, name)
        assert mine.dtype == theirs.dtype and mine.shape == theirs.shape
        assert mine.tobytes() == theirs.tobytes(), name


@pytest.mark.parametrize('n', [0, 1, 20])
def test_requests_come_back_exactly(n):
    stamp, turn, objects = reproposal.parsed_request(
        reproposal.request_text(10**18 + 1, 2, some(n)))
    assert (stamp, turn) == (10**18 + 1, 2)
    same(objects, some(n))


@pytest.mark.parametrize('text', ['', '[]', '{}', '{"format": "hooc-request/9"}'])
def test_foreign_requests_are_refused(text):
    with pytest.raises(HoocError, match='candidates/requests'):
        reproposal.parsed_request(text)


class Asking(StageNode):
    """Has nothing but the asking side."""

    def __init__(self, **kwargs):
        super().__init__('asking', StageConfig(), **kwargs)

    def configure(self):
        self.more = reproposal.MoreCandidates(self, 8)


@pytest.fixture
def asking(bench):
    """Return (active asking node, function that answers from the peer's thread)."""
    node = bench.add(Asking)
    # Not spun while it asks, as in the middle of a callback.
    bench.executor.remove_node(node)
    answers = [bench.peer.create_publisher(kind, f'candidates/more/{part}',
                                           qos(f'candidates/more/{part}'))
               for part, kind in (('poses', PoseArray), ('attributes', PointCloud2))]
    requests = bench.hear(String, 'candidates/requests', qos('candidates/requests'))
    node.trigger_configure()
    node.trigger_activate()
    assert bench.spin(lambda: all(p.get_subscription_count() for p in answers)
                      and node.count_subscribers('/hooc/candidates/requests'))
    bench.rest(0.2)

    def answer(candidates, stamp_ns, turn):
        messages = candidates_messages(candidates, header(stamp_ns, 'table'), turn)
        for publisher, message in zip(answers, messages):
            publisher.publish(message)
    return node, answer, requests


def asked(bench, node, stamp_ns, turn, timeout_s=10.0):
    """Return the thread that asks, and the list that will hold the answer."""
    got = []
    thread = threading.Thread(target=lambda: got.append(
        node.more.asker(stamp_ns, timeout_s)(some(3), turn)), daemon=True)
    thread.start()
    return thread, got


@pytest.mark.parametrize('n', [0, 40])
def test_the_answer_arrives_while_the_callback_waits(bench, asking, n):
    node, answer, requests = asking
    thread, got = asked(bench, node, 77, 1)
    assert bench.spin(lambda: requests)
    stamp, turn, objects = reproposal.parsed_request(requests[0].data)
    assert (stamp, turn) == (77, 1)
    same(objects, some(3))
    answer(some(n, 5), 77, 1)
    thread.join(10)
    same(got[0], some(n, 5))


def test_answers_to_other_questions_are_passed_over(bench, asking):
    node, answer, requests = asking
    answer(some(2, 1), 76, 2)
    thread, got = asked(bench, node, 77, 2)
    assert bench.spin(lambda: requests)
    answer(some(2, 2), 76, 2)
    answer(some(2, 3), 77, 1)
    answer(some(4, 4), 77, 2)
    thread.join(10)
    same(got[0], some(4, 4))


def test_silence_brings_nothing_and_is_reported(bench, asking):
    node, answer, requests = asking
    thread, got = asked(bench, node, 77, 1, timeout_s=0.3)
    thread.join(10)
    assert len(got[0]) == 0
    assert bench.reasons(node)['parse'][0] == 'no_more_candidates'


@pytest.mark.parametrize('flaw', [{'category': np.array([9], np.uint16)},
                                  {'rotation_xyzw': np.zeros((1, 4))}])
def test_answers_of_another_model_bring_nothing(bench, asking, flaw):
    node, answer, requests = asking
    thread, got = asked(bench, node, 77, 1)
    assert bench.spin(lambda: requests)
    answer(replace(some(1), **flaw), 77, 1)
    thread.join(10)
    assert len(got[0]) == 0
    code, sentence = bench.reasons(node)['parse']
    assert code == 'no_more_candidates' and 'candidates' in sentence


@pytest.fixture
def proposing(bench, asking, folder):
    """Return (asking node, active candidate node that it asks)."""
    node = bench.add(candidate_node.CandidateNode, model=str(folder.path), warm_up=False)
    node.trigger_configure()
    node.trigger_activate()
    topics = ('/hooc/candidates/requests', '/hooc/candidates/more/poses')
    assert bench.spin(lambda: asking[0].count_subscribers(topics[0]) == 2
                      and asking[0].count_publishers(topics[1]) == 2)
    bench.rest(0.3)
    return asking[0], node


def answered(bench, node, stamp_ns, turn=1):
    """Return what the candidate node answers; it has to, long before the patience ends."""
    thread, got = asked(bench, node, stamp_ns, turn, timeout_s=300.0)
    assert bench.spin(lambda: not thread.is_alive(), 20.0), 'still waiting'
    return got[0]


def test_the_last_few_sets_can_be_asked_for(bench, proposing):
    asking, node = proposing
    for stamp in range(1, 8):
        node.proposers.keep(stamp, lambda objects, turn, stamp=stamp: some(stamp, turn))
    assert len(node.proposers) == 4
    same(answered(bench, asking, 4), some(4, 1))
    # What is asked for is needed again in the next round.
    for stamp in range(8, 11):
        node.proposers.keep(stamp, None)
    same(answered(bench, asking, 4, 2), some(4, 2))


def test_a_forgotten_set_is_answered_at_once(bench, proposing):
    asking, node = proposing
    assert len(answered(bench, asking, 1)) == 0
    assert bench.reasons(asking)['parse'][0] == 'no_more_candidates'
    assert 'wait_for_answer_s' in bench.reasons(node)['propose'][1]


def test_a_round_that_fails_is_answered(bench, proposing):
    asking, node = proposing

    def fail(objects, turn):
        raise error
    node.proposers.keep(1, fail)
    for error in (HoocError('no such thing'), ValueError('a surprise')):
        assert len(answered(bench, asking, 1)) == 0
        assert any(str(error) in sentence for _, sentence in bench.reasons(node).values())
    # Nothing to propose is an answer like any other, and no trouble.
    node.proposers.keep(2, lambda objects, turn: some(0))
    asking.diagnostics._counts.clear()
    assert len(answered(bench, asking, 2)) == 0 and not asking.diagnostics._counts


@pytest.mark.parametrize('younger, found', [(3, 2), (4, 0)])
def test_sets_that_overtake_a_parse_do_not_stop_the_chain(bench, make_chain, monkeypatch,
                                                          younger, found):
    monkeypatch.setattr(candidate_node, 'proposer', lambda *_: lambda objects, turn: objects)
    stages, send = make_chain(parameters={0: {'wait_for_answer_s': 0.0},
                                          3: {'more_timeout_s': 20.0}})
    candidates, parsing = bench.chain[2:]
    answers = bench.hear(PoseArray, 'objects/poses', qos('objects/poses'))
    # As in processes of their own: they work on while parsing waits.
    others = SingleThreadedExecutor(context=bench.context)
    for node in bench.chain[:3]:
        bench.executor.remove_node(node)
        others.add_node(node)
    threading.Thread(target=others.spin, daemon=True).start()
    parse, first = stages.parse, []

    def overtaken(*args):
        monkeypatch.setattr(parsing_node, 'parse', parse)
        for _ in range(younger):
            stamp, deadline = send(), time.monotonic() + 10
            while stamp not in candidates.proposers and time.monotonic() < deadline:
                time.sleep(0.005)
        stages.turns = (1,)
        parsed = parse(*args)
        first.append(stages.asked[0])
        return parsed
    monkeypatch.setattr(parsing_node, 'parse', overtaken)
    send()
    assert bench.spin(lambda: answers, 30.0)
    others.shutdown()
    assert len(first[0]) == found
    code, sentence = bench.reasons(parsing)['parse']
    assert code == ('ok' if found else 'no_more_candidates')
    assert found or 'could not answer' in sentence, 'it waited in vain'

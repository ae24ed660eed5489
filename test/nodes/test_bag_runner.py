# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Which answer of a played bag is taken, and when none can come any more; without processes."""

import json
from types import SimpleNamespace

from hooc_perception.errors import HoocError
import pytest

pytest.importorskip('rclpy')

S = 10 ** 9
BAG = SimpleNamespace(name='10_1', info={'sequence': None}, depth_topics={'a': '/a', 'b': '/b'},
                      topics={'/a': SimpleNamespace(count=2), '/b': SimpleNamespace(count=2)})
REFUSED = 'a: it holds no reading; the image is dropped'


class Script:
    """A supervisor that lets one event happen whenever somebody waits."""

    def __init__(self):
        from hooc_perception.supervisor.bags import BagRunner
        self.node = SimpleNamespace(create_subscription=lambda *_: None,
                                    destroy_subscription=lambda _: None)
        self.processes, self.events, self.now = {}, [], 0
        self.runner = BagRunner(self, 60.0)
        self.heard = self.runner._collector
        self.heard.expect(['a', 'b'])
        # The parts of an answer are not looked into here.
        self.heard.result = lambda stamp: (
            SimpleNamespace(stamp_ns=stamp) if stamp in self.heard._published else None)

    def wait(self, condition, timeout_s, complaint):
        while not (value := condition()):
            if not self.events:
                raise HoocError(complaint() if callable(complaint) else complaint)
            self.events.pop(0)()
        return value

    def sent(self, when=None):
        self.now += 1
        return {'source_timestamp': self.now if when is None else when}

    def image(self, camera, stamp):
        message = SimpleNamespace(header=SimpleNamespace(stamp=time(stamp)))
        self.events.append(lambda: self.heard._image_taker(camera)(
            message, {'received_timestamp': stamp, **self.sent()}))

    def answer(self, stamp):
        message = SimpleNamespace(header=SimpleNamespace(stamp=time(stamp)))
        self.events.append(lambda: self.heard._taker('objects/poses')(
            message, self.sent()))

    def finish(self):
        from std_msgs.msg import String
        self.events.append(lambda: self.heard._on_status(
            String(data=json.dumps({'state': 'finished'})), self.sent()))

    def report(self, node, thing, sentence='', **values):
        from diagnostic_msgs.msg import DiagnosticStatus
        level = DiagnosticStatus.ERROR if sentence else DiagnosticStatus.OK
        self.state(node, thing, sentence or 'ok', level, **values)

    def state(self, node, thing, sentence, level=b'\0', sent=None, **values):
        from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
        status = DiagnosticStatus(
            name=f'{node}: {thing}', message=sentence, level=level,
            values=[KeyValue(key=k, value=str(v)) for k, v in values.items()])
        message = DiagnosticArray(status=[status])
        message.header.stamp = time(S)
        self.events.append(lambda: self.heard._on_diagnostics(message, self.sent(sent)))

    def idle(self, sent=None):
        for _ in range(2):
            self.report('ingestion_node', 'views', **({'stamp_ns': sent} if sent else {}))

    def all_idle(self, sent, but=None):
        for _ in range(8):
            self.report('ingestion_node', 'views', stamp_ns=sent)
            for name in ('classification_node', 'candidate_node', 'parsing_node'):
                if name != but:
                    self.report(name, 'node')

    def listen(self, bag=BAG):
        return self.runner._collect(bag, 0)


def time(stamp_ns):
    from hooc_perception.ros.messages.conversions import time_message
    return time_message(stamp_ns)


@pytest.fixture
def script():
    return Script()


def play(script, a, b):
    for stamp in a:
        script.image('a', stamp)
    for stamp in b:
        script.image('b', stamp)
    script.finish()


def test_cameras_that_end_together_are_answered_at_once(script):
    play(script, [1 * S, 2 * S], [1 * S, 2 * S])
    script.answer(1 * S)
    script.answer(2 * S)
    assert script.listen().stamp_ns == 2 * S


def test_the_last_images_of_a_sequence_are_waited_for(script):
    play(script, [1 * S], [1 * S])
    script.answer(1 * S)
    # The news that the bag is played to its end has overtaken them.
    script.image('a', 2 * S)
    script.image('b', 2 * S)
    script.answer(2 * S)
    told = {'sequence': {'frame_sets': {'first': None, 'second': None}}}
    assert script.listen(SimpleNamespace(**{**vars(BAG), 'info': told})).stamp_ns == 2 * S


def test_the_newest_answer_is_taken_where_one_camera_goes_on_alone(script):
    play(script, [1 * S, 6 * S, 7 * S], [1 * S + 10])
    script.answer(1 * S)
    script.idle(sent=1 * S)
    assert script.listen().stamp_ns == 1 * S


def test_a_set_under_way_is_waited_for(script):
    play(script, [1 * S, 2 * S, 9 * S], [1 * S + 10, 2 * S + 10])
    script.answer(1 * S)
    script.idle(sent=2 * S)
    script.answer(2 * S)
    script.idle(sent=2 * S)
    assert script.listen().stamp_ns == 2 * S


def test_a_refused_image_does_not_cost_the_answer(script):
    script.report('ingestion_node', 'a', REFUSED)
    play(script, [1 * S, 2 * S], [1 * S + 10, 2 * S + 10])
    script.answer(1 * S)
    script.idle(sent=1 * S)
    assert script.listen().stamp_ns == 1 * S


def test_refused_images_alone_are_the_reason(script):
    script.report('ingestion_node', 'a', REFUSED)
    play(script, [1 * S], [1 * S + 10])
    script.idle()
    with pytest.raises(HoocError, match='no reading'):
        script.listen()


def test_cameras_that_never_meet_are_said_to(script):
    play(script, [1 * S], [5 * S])
    script.idle()
    with pytest.raises(HoocError, match='no moment is seen by all of its cameras'):
        script.listen()


def test_reports_that_were_sent_before_the_images_tell_nothing(script):
    play(script, [1 * S], [1 * S])
    for _ in range(2):
        script.state('ingestion_node', 'views', 'ok', sent=0)
    script.answer(1 * S)
    assert script.listen().stamp_ns == 1 * S


def test_a_stage_that_gives_up_ends_the_wait(script):
    script.report('parsing_node', 'parse', 'the model does not fit')
    script.image('a', 1 * S)
    with pytest.raises(HoocError, match='the model does not fit'):
        script.listen()


def test_where_no_answer_comes_the_nodes_are_quoted(script):
    script.report('parsing_node', 'node')
    script.state('classification_node', 'classify', 'waits for the first frame set')
    play(script, [1 * S], [1 * S])
    script.idle(sent=1 * S)
    with pytest.raises(HoocError, match=(
            r'no objects came within 60 s .*classification_node: classify waits for the first '
            'frame set; ingestion_node: ok; parsing_node: ok')):
        script.listen()


def test_a_set_that_nobody_works_on_is_lost(script):
    from hooc_perception.supervisor.bags import FrameSetLost
    play(script, [1 * S], [1 * S])
    script.all_idle(sent=1 * S)
    with pytest.raises(FrameSetLost, match='part of it was lost .* parsing_node: ok'):
        script.listen()


def test_a_node_that_computes_is_waited_for(script):
    play(script, [1 * S], [1 * S])
    script.all_idle(sent=1 * S, but='parsing_node')
    script.answer(1 * S)
    assert script.listen().stamp_ns == 1 * S


def test_parts_of_an_answer_are_news(script):
    play(script, [1 * S], [1 * S])
    script.all_idle(sent=1 * S, but='parsing_node')
    script.events.append(lambda: script.heard._taker('pixels/probabilities')(
        SimpleNamespace(header=SimpleNamespace(stamp=time(S))), script.sent()))
    for _ in range(8):
        script.report('parsing_node', 'node')
    script.answer(1 * S)
    assert script.listen().stamp_ns == 1 * S


def test_a_lost_set_is_played_once_more(script, monkeypatch, capsys):
    from hooc_perception.supervisor.bags import FrameSetLost
    answers, begun = [FrameSetLost('gone'), 'answer', *[FrameSetLost('gone')] * 2], []

    def one_play(bag):
        if isinstance(answers[0], HoocError):
            raise answers.pop(0)
        return answers.pop(0)
    monkeypatch.setattr(script.runner, '_play', one_play)
    monkeypatch.setattr(script.runner, 'start_over', lambda: begun.append(True))
    assert script.runner.play(BAG) == 'answer' and begun == [True]
    assert 'gone; playing it once more' in capsys.readouterr().err
    with pytest.raises(HoocError, match='gone'):
        script.runner.play(BAG)


def test_what_ingestion_said_of_the_last_bag_does_not_count(script):
    script.heard.last_sent = 1 * S
    script.heard.expect(['a', 'b'])
    play(script, [2 * S], [9 * S])
    script.idle(sent=1 * S)
    with pytest.raises(HoocError, match='no moment is seen'):
        script.listen()


def test_an_answer_knows_its_images():
    from hooc_perception.supervisor.collector import Collector
    node = SimpleNamespace(create_subscription=lambda *_: None,
                           destroy_subscription=lambda _: None)
    collector = Collector(node)
    collector.expect(['a', 'b'])
    collector.image_stamps = {'a': [1, 5, 9], 'b': [2, 6]}
    assert collector.images_of(5) == {'a': 1, 'b': 1}

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The parsing node decides everything anew in the background while nothing changes."""

from functools import partial
import time

from hooc_perception.errors import HoocError
from hooc_perception.nodes import following
from hooc_perception.nodes.background import Background
import pytest

pytest.importorskip('rclpy')
from rclpy.lifecycle import TransitionCallbackReturn  # noqa: E402
from std_srvs.srv import Trigger


class Puppet:
    """A Background that ends when the test says so."""

    made = []

    def __init__(self, work):
        self.work, self.is_done, self.is_discarded, self.answer = work, False, False, None
        Puppet.made.append(self)

    def end(self, answer):
        """End with an answer: a function of the one before, or an error."""
        self.is_done, self.answer = True, answer

    def result(self):
        if isinstance(self.answer, Exception):
            raise self.answer
        return self.answer(self.work.before)

    def discard(self):
        self.is_discarded = True


@pytest.fixture
def puppet(live, monkeypatch):
    """Return (stages, function that returns an answer, list of Puppets), the first one begun."""
    monkeypatch.setattr(following, 'Background', Puppet)
    monkeypatch.setattr(Puppet, 'made', [])
    stages, answer = live(full_every_s=0.001)
    assert len(answer().poses) == 2 and not Puppet.made
    assert len(answer().poses) == 2 and len(Puppet.made) == 1
    stages.given.clear()
    return stages, answer, Puppet.made


def only_the_first(scene):
    return scene.take([0])


def call(bench, name):
    """Call a Trigger service of the chain; return its future."""
    client = bench.peer.create_client(Trigger, name)
    assert client.wait_for_service(5.0)
    return client.call_async(Trigger.Request())


def test_the_standing_answer_is_given_until_the_new_one_takes_over(bench, puppet):
    stages, answer, made = puppet
    standing = answer()
    assert answer().poses == standing.poses and len(standing.poses) == 2
    assert len(made) == 1 and not stages.given      # one at a time, and nothing beside it
    made[0].end(only_the_first)
    bench.rest(0.2)
    assert len(bench.heard['objects/poses']) == 4   # with the next frame set, not before
    # Nothing else has changed, so the next frame set has the same answer again.
    assert answer().poses == standing.poses[:1] == answer().poses
    assert bench.reasons(bench.chain[3])['full_parse'][0] == 'ok' and not made[0].is_discarded
    assert bench.chain[3].diagnostics._counts['full_parse', 'ended'] == 1


def test_a_change_makes_it_useless(puppet):
    stages, answer, made = puppet
    made[0].end(only_the_first)
    stages.chosen = []
    assert answer(empty=True).poses == [] and 'parse' in stages.given
    assert made[0].is_discarded
    assert answer(empty=True).poses == [] == answer(empty=True).poses


def test_after_reset_its_answer_is_not_published(bench, puppet):
    stages, answer, made = puppet
    made[0].end(only_the_first)
    assert bench.spin(call(bench, 'reset').done)
    assert made[0].is_discarded
    bench.rest(0.2)     # the retraction
    assert len(answer().poses) == 2 and 'parse' in stages.given


def test_an_inactive_node_gives_it_up(bench, puppet):
    _, answer, made = puppet
    node = bench.chain[3]
    assert node.trigger_deactivate() == TransitionCallbackReturn.SUCCESS
    made[0].end(only_the_first)
    assert made[0].is_discarded
    assert node.trigger_activate() == TransitionCallbackReturn.SUCCESS
    bench.rest(0.2)     # the retraction
    assert len(answer().poses) == 2 and len(made) == 2


@pytest.mark.parametrize('transition', ['trigger_shutdown', 'trigger_deactivate'])
def test_nothing_runs_on_when_the_node_ends(bench, live, monkeypatch, transition):
    begun = []

    def endless(work):
        begun.append(Background(partial(time.sleep, 600)))
        return begun[-1]
    monkeypatch.setattr(following, 'Background', endless)
    _, answer = live(full_every_s=0.001)
    answer()
    answer()
    assert len(begun) == 1
    getattr(bench.chain[3], transition)()
    assert bench.spin(lambda: begun[0].is_done)


def test_a_failure_is_reported_and_it_is_tried_again(bench, puppet):
    _, answer, made = puppet
    made[0].end(HoocError('there is too little memory'))
    assert len(answer().poses) == 2
    reason, sentence = bench.reasons(bench.chain[3])['full_parse']
    assert reason == 'failed' and 'there is too little memory' in sentence
    assert bench.reasons(bench.chain[3])['parse'][0] == 'ok'
    assert len(answer().poses) == 2 and len(made) == 2


def test_a_process_that_cannot_be_started_is_reported(bench, live, monkeypatch):
    def refuse(work):
        raise OSError('no more processes')
    monkeypatch.setattr(following, 'Background', refuse)
    _, answer = live(full_every_s=0.001)
    answer()
    assert len(answer().poses) == 2
    assert 'no more processes' in bench.reasons(bench.chain[3])['full_parse'][1]


def test_detect_can_ask_for_a_full_parse_and_waits_for_it(bench, live, monkeypatch):
    monkeypatch.setattr(following, 'Background', Puppet)
    monkeypatch.setattr(Puppet, 'made', [])
    stages, answer = live(full_every_s=0.001, detect_full=True)
    answer()
    answer()
    stages.given.clear()
    done = call(bench, 'detect')
    assert bench.spin(lambda: bench.chain[3].detect.is_waited_for)
    answer()
    assert bench.spin(done.done) and done.result().success
    # It is revised, which asks stage 3, in this process.
    assert 'propose' in stages.given and Puppet.made[0].is_discarded


def test_without_a_period_nothing_is_begun(live, monkeypatch):
    monkeypatch.setattr(following, 'Background', Puppet)
    monkeypatch.setattr(Puppet, 'made', [])
    _, answer = live(full_every_s=0.0)
    for _ in range(3):
        answer()
    assert not Puppet.made


def test_another_process_finds_what_the_answer_lacks(bench, live, cheap):
    """The real thing: two of the three objects are known, and the third one is found."""
    stages, answer = live(full_every_s=0.001, **{
        name.replace('.', '__'): value for name, value in cheap['candidate_node'].items()})
    assert len(answer().poses) == 2
    stages.given.clear()
    for _ in range(400):
        poses = answer().poses
        if len(poses) > 2:
            break
        bench.rest(0.1)
    assert len(poses) == 3 and 'parse' not in stages.given, bench.reasons(bench.chain[3])

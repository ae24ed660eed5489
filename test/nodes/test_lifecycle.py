# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Transitions that do what they say, parameters that arrive, callbacks that survive."""

import gc
import weakref

from hooc_perception.errors import HoocError
from hooc_perception.objects.derive import derive
from hooc_perception.trained.folder import save_model_folder
import numpy as np
import pytest
import trimesh

pytest.importorskip('rclpy')

from hooc_perception.core.classification.classify import FORMAT_VERSION, KIND_PAPER
from hooc_perception.nodes import (
    candidate_node,
    classification_node,
    ingestion_node,
    parsing_node,
    replay_node,
)
from hooc_perception.nodes.warm_up import overhead_camera
from hooc_perception.ros.lifecycle.memory import give_back_memory
from hooc_perception.ros.lifecycle.misaddressed import misaddressed
from hooc_perception.ros.lifecycle.stage_node import StageNode
from hooc_perception.supervisor.params_file import unreached_sections
from lifecycle_msgs.msg import Transition  # noqa: E402
from lifecycle_msgs.srv import ChangeState, GetState  # noqa: E402
from rclpy.lifecycle import TransitionCallbackReturn  # noqa: E402
from rclpy.parameter import Parameter  # noqa: E402
from std_msgs.msg import String  # noqa: E402

SUCCESS, FAILURE = TransitionCallbackReturn.SUCCESS, TransitionCallbackReturn.FAILURE


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    """Return the ModelFolder of a box and a view-bound classifier for two cameras."""
    rng = np.random.default_rng(0)
    models = [derive('box', trimesh.creation.box((0.1, 0.06, 0.08)), rng, 50, 50)]
    from dataclasses import replace
    cameras = [replace(overhead_camera(), name=name) for name in ('left', 'right')]
    classifier = {'kind': np.array(KIND_PAPER), 'version': np.array(FORMAT_VERSION)}
    return save_model_folder(tmp_path_factory.mktemp('m') / 'model', 'm', models, classifier,
                             'paper', 0, cameras)


@pytest.mark.parametrize('module, kind', [
    (ingestion_node, 'IngestionNode'), (classification_node, 'ClassificationNode'),
    (candidate_node, 'CandidateNode'), (parsing_node, 'ParsingNode')])
def test_cleaning_up_forgets_everything_that_was_built(bench, folder, module, kind):
    node = bench.add(getattr(module, kind), model=str(folder.path), warm_up=False)
    before = set(vars(node))
    endpoints = len(list(node.publishers)), len(list(node.subscriptions)), len(list(node.timers))
    for _ in range(2):
        assert node.trigger_configure() == SUCCESS, bench.reasons(node)
        models = getattr(node.work, 'models', None)
        kept = [weakref.ref(x) for x in (
            node.work, getattr(node.work, 'assembly', None), getattr(node.work, 'output', None),
            getattr(node.work, 'input', None), models[0] if models else None) if x is not None]
        assert len(kept) > 1
        del models
        assert node.trigger_activate() == SUCCESS and node.trigger_deactivate() == SUCCESS
        assert node.trigger_cleanup() == SUCCESS
        gc.collect()
        assert [ref() for ref in kept] == [None] * len(kept)
        assert {n for n in set(vars(node)) - before if not n.startswith('_')} == set()
        assert endpoints == (len(list(node.publishers)), len(list(node.subscriptions)),
                             len(list(node.timers)))


@pytest.mark.parametrize('wrong', [
    Transition(id=Transition.TRANSITION_ACTIVATE), Transition(id=99),
    Transition(label='activate'), Transition(label='no such thing')])
def test_an_impossible_transition_is_refused_and_costs_nothing(bench, wrong):
    node = bench.add(replay_node.ReplayNode)
    client = bench.peer.create_client(ChangeState, '/hooc/replay_node/change_state')
    states = bench.peer.create_client(GetState, '/hooc/replay_node/get_state')
    assert bench.spin(lambda: client.service_is_ready() and states.service_is_ready())
    bench.rest(0.2)
    answer = client.call_async(ChangeState.Request(transition=wrong))
    assert bench.spin(answer.done) and not answer.result().success
    state = states.call_async(GetState.Request())
    assert bench.spin(state.done) and state.result().current_state.label == 'unconfigured'
    assert node.trigger_activate() == FAILURE


def test_memory_comes_back_to_the_system(bench):
    psutil = pytest.importorskip('psutil')

    class Large(StageNode):
        def __init__(self, **kwargs):
            super().__init__('large', **kwargs)

        def configure(self):
            return [np.ones(10_000) for _ in range(2500)]       # 200 MB in small pieces

    node, process = bench.add(Large), psutil.Process()
    # What earlier tests have left free in pieces would take a part of the 200 MB.
    give_back_memory()
    before = process.memory_info().rss
    assert node.trigger_configure() == SUCCESS
    assert process.memory_info().rss - before > 150e6
    assert node.trigger_cleanup() == SUCCESS
    assert process.memory_info().rss - before < 50e6


def test_a_model_for_another_number_of_cameras_is_refused_at_once(bench, folder):
    node = bench.add(classification_node.ClassificationNode, model=str(folder.path),
                     cameras=['left'], warm_up=False)
    assert node.trigger_configure() == FAILURE
    assert 'trained for 2 cameras' in bench.reasons(node)['node'][1]


def test_a_stage_without_its_inputs_says_which_node_is_missing(bench, folder, monkeypatch):
    monkeypatch.setattr('hooc_perception.ros.inputs.view_input.EXPLAIN_AFTER_S', 0.3)
    node = bench.add(candidate_node.CandidateNode, model=str(folder.path), warm_up=False)
    node.trigger_configure(), node.trigger_activate()
    assert bench.spin(lambda: 'input' in bench.reasons(node))
    code, sentence = bench.reasons(node)['input']
    assert code == 'no_publisher' and 'ingestion_node and classification_node' in sentence
    assert '/hooc/views/left/depth_rect' in sentence and 'left, right' in sentence


def test_an_error_nobody_thought_of_costs_one_message(bench):
    class Fragile(StageNode):
        def __init__(self, **kwargs):
            super().__init__('fragile', **kwargs)

        def configure(self):
            self.heard = []
            self.subscription(String, 'scene/summary', self.take)

        def take(self, message):
            self.heard.append(1 / len(message.data))

    from hooc_perception.ros.qos import qos
    node = bench.add(Fragile)
    node.trigger_configure()
    publisher = bench.peer.create_publisher(String, 'scene/summary', qos('scene/summary'))
    assert bench.spin(publisher.get_subscription_count)
    publisher.publish(String())
    assert bench.spin(lambda: 'input' in bench.reasons(node))
    assert 'ZeroDivisionError' in bench.reasons(node)['input'][1]
    publisher.publish(String(data='xx'))
    assert bench.spin(lambda: node.heard == [0.5])


@pytest.mark.parametrize('name, word', [
    ('max_set_spread', 'is max_set_spread_s meant?'), ('max_instance', 'max_instances meant'),
    ('observe.max_depth', 'observe.max_depth_m meant'), ('colour', 'docs/nodes.md'),
    ('extrinsics.kinect9', 'the cameras are a'), ('qos_overrides./hooc/x.publisher.depth',
                                                  'overrides the QoS of nothing')])
def test_parameters_that_nobody_takes_are_reported(bench, name, word):
    node = bench.add(ingestion_node.IngestionNode, cameras=['a'], warm_up=False,
                     **{name: 1})
    assert node.trigger_configure() == SUCCESS
    code, sentence = bench.reasons(node)['parameters']
    assert code == 'unknown_parameter' and word in sentence, sentence


@pytest.mark.parametrize('name, word', [
    ('kinect-1', 'such as kinect_1'), ('2nd', 'such as _2nd'), ('a//b', 'digits and _'),
    ('', 'digits and _'), ('left/wrist', None)])
def test_cameras_that_no_topic_can_be_named_after_are_refused(bench, name, word):
    node = bench.add(ingestion_node.IngestionNode, cameras=[name], warm_up=False)
    assert (node.trigger_configure() == SUCCESS) == (word is None)
    if word:
        sentence = bench.reasons(node)['node'][1]
        assert repr(name) in sentence and word in sentence and 'unexpected' not in sentence


def test_what_other_nodes_take_is_not_reported(bench):
    """As in a section for all nodes."""
    node = bench.add(ingestion_node.IngestionNode, cameras=['a'], warm_up=False,
                     **{'max_instances': 1, 'parse.rounds': 1, 'rate': 1.0})
    assert node.trigger_configure() == SUCCESS
    assert 'parameters' not in bench.reasons(node)
    assert misaddressed(['use_sim_time', 'seed'], ['seed']) == []


@pytest.mark.parametrize('section, found, word', [
    ('/**', True, ''), ('/**/parsing_node', True, ''), ('/hooc/parsing_node', True, ''),
    ('/*/parsing_node', True, ''), ('parsing_node', False, '/**/parsing_node'),
    ('/**/parse_node', False, '/**/parsing_node'),
    ('/other/ingestion_node', False, 'applies to no node'),
    ('/**/zebra', False, 'the nodes are /hooc/ingestion_node')])
def test_sections_that_reach_no_node_are_reported(tmp_path, section, found, word):
    path = tmp_path / 'p.yaml'
    path.write_text(f'"{section}":\n  ros__parameters:\n    seed: 1\n'
                    'hooc:\n  ingestion_node:\n    ros__parameters: {}\n')
    sentences = unreached_sections(path, ['ingestion_node', 'parsing_node'], '/hooc')
    assert len(sentences) == (0 if found else 1) and all(word in s for s in sentences)
    path.write_text('a: [')
    with pytest.raises(HoocError, match='YAML'):
        unreached_sections(path, ['ingestion_node'], '/hooc')


def test_qos_can_be_overridden(bench):
    name = 'qos_overrides./hooc/views/points.publisher.depth'
    node = bench.add(ingestion_node.IngestionNode, cameras=['a'], warm_up=False, **{name: 7})
    assert node.trigger_configure() == SUCCESS
    (publisher,) = (p for p in node.publishers if p.topic_name == '/hooc/views/points')
    assert publisher.qos_profile.depth == 7
    assert 'parameters' not in bench.reasons(node)


@pytest.mark.parametrize('name, value, word', [
    ('max_set_spread_s', 0.2, None), ('min_cameras', 2, None), ('fuse_frames', 3, None),
    ('fuse_frames', 31, 'range'), ('cameras', ['b'], 'clean up'),
    ('profile', 'best', 'read-only')])
def test_what_may_change_while_running_does(bench, name, value, word):
    node = bench.add(ingestion_node.IngestionNode, cameras=['a'], warm_up=False)
    assert node.trigger_configure() == SUCCESS and node.trigger_activate() == SUCCESS
    (result,) = node.set_parameters([Parameter(name, value=value)])
    assert result.successful == (word is None)
    if word:
        assert word in result.reason.lower()
    else:
        assert getattr(node.config, name) == value


def test_a_simulated_clock_that_nobody_gives_is_named(bench):
    from rosgraph_msgs.msg import Clock as ClockMessage
    node = bench.add(ingestion_node.IngestionNode, cameras=['a'], warm_up=False,
                     use_sim_time=True, explain_after_s=0.5)
    assert node.trigger_configure() == SUCCESS and node.trigger_activate() == SUCCESS
    assert bench.spin(lambda: 'clock' in bench.reasons(node))
    assert bench.reasons(node)['clock'][0] == 'no_clock'
    # What else is wrong is said though time stands still.
    assert bench.spin(lambda: bench.reasons(node).get('a', ' ')[0] == 'no_publisher')
    publisher = bench.peer.create_publisher(ClockMessage, '/clock', 1)
    assert bench.spin(lambda: node.count_publishers('/clock'))
    publisher.publish(ClockMessage(clock=node.get_clock().now().to_msg()))


@pytest.mark.parametrize('kind', (classification_node.ClassificationNode,
                                  candidate_node.CandidateNode,
                                  parsing_node.ParsingNode))
def test_models_that_cannot_be_read(bench, kind, tmp_path):
    node = bench.add(kind, model=str(tmp_path))
    assert node.trigger_configure() == FAILURE
    assert 'model.json' in bench.reasons(node)['node'][1]
    assert node.is_unconfigured()


@pytest.mark.parametrize('module, kind', [
    (ingestion_node, 'IngestionNode'), (classification_node, 'ClassificationNode'),
    (candidate_node, 'CandidateNode'), (parsing_node, 'ParsingNode'),
    (replay_node, 'ReplayNode')])
def test_a_node_goes_its_whole_way_and_leaves_nothing_behind(bench, folder, repository, module,
                                                             kind):
    own = {'model': str(folder.path), 'warm_up': False}
    if kind == 'ReplayNode':
        own = {'bag': str(repository / 'bags' / 'demo')}
        if not (repository / 'bags' / 'demo').is_dir():
            pytest.skip('no bundled scene: make it with "make bundle"')
    node = bench.add(getattr(module, kind), **own)
    name = node.get_name()

    def topics():
        """Return what others see of the topics of the node."""
        return {topic for topic, _ in bench.peer.get_publisher_names_and_types_by_node(
            name, '/hooc')}

    assert bench.spin(topics)
    before = topics()
    change = bench.peer.create_client(ChangeState, f'{name}/change_state')
    state = bench.peer.create_client(GetState, f'{name}/get_state')
    assert bench.spin(change.service_is_ready) and bench.spin(state.service_is_ready)
    for step, reached in ((Transition.TRANSITION_CONFIGURE, 'inactive'),
                          (Transition.TRANSITION_ACTIVATE, 'active'),
                          (Transition.TRANSITION_DEACTIVATE, 'inactive'),
                          (Transition.TRANSITION_CLEANUP, 'unconfigured'),
                          (Transition.TRANSITION_CONFIGURE, 'inactive'),
                          (Transition.TRANSITION_ACTIVATE, 'active'),
                          (Transition.TRANSITION_ACTIVE_SHUTDOWN, 'finalized')):
        done = change.call_async(ChangeState.Request(transition=Transition(id=step)))
        assert bench.spin(done.done, 20.0) and done.result().success, bench.reasons(node)
        said = state.call_async(GetState.Request())
        assert bench.spin(said.done) and said.result().current_state.label == reached
        assert node.active == (reached == 'active')
        built = reached in ('inactive', 'active')
        assert bench.spin(lambda built=built: (topics() > before) if built
                          else topics() == before), (reached, topics() ^ before)
    assert bench.reasons(node)['node'][0] == 'ok'

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Nodes in this process, beside a node of the test, on a domain of their own."""

from dataclasses import replace
import time

from hooc_perception.core.geometry import pose_from_matrix
from hooc_perception.core.methods.joint import JointMethod
from hooc_perception.core.segment.observe import observe
from hooc_perception.core.types import Energy, ParsedScene
from hooc_perception.nodes.warm_up import made_up_scene, overhead_camera
from hooc_perception.objects.derive import derive
from hooc_perception.parser import Parser
from hooc_perception.trained.folder import save_model_folder
import numpy as np
import pytest
import trimesh

TURN_S = 0.02


class Bench:
    """An executor with the node under test and a `peer` that talks to it."""

    def __init__(self, context):
        from rclpy.executors import SingleThreadedExecutor
        from rclpy.node import Node
        self.context = context
        self.peer = Node('peer', namespace='/hooc', context=context)
        self.executor = SingleThreadedExecutor(context=context)
        self.executor.add_node(self.peer)
        self.heard, self.nodes = {}, []

    def add(self, kind, remaps=(), **parameters):
        """Return a node with these parameters and `from:=to`, spun with the others."""
        from rclpy.parameter import Parameter
        words = [word for remap in remaps for word in ('-r', remap)]
        node = kind(context=self.context, cli_args=['--ros-args', *words] if words else None,
                    parameter_overrides=[Parameter(name.replace('__', '.'), value=value)
                                         for name, value in parameters.items()])
        self.executor.add_node(node)
        self.nodes.append(node)
        return node

    def hear(self, kind, topic, profile):
        """Collect what is said on a topic, in the list that is returned."""
        self.heard[topic] = []
        self.peer.create_subscription(kind, topic, self.heard[topic].append, profile)
        return self.heard[topic]

    def spin(self, condition, timeout_s=30.0):
        """Serve callbacks until a condition holds; return whether it came to hold."""
        deadline = time.monotonic() + timeout_s
        while not (value := condition()) and time.monotonic() < deadline:
            self.executor.spin_once(timeout_sec=TURN_S)
        return value

    def rest(self, seconds=0.4):
        """Serve callbacks for so long, and as often as an idle machine would do it meanwhile."""
        turns, start = seconds / TURN_S, time.monotonic()
        while turns > 0 or time.monotonic() - start < seconds:
            self.executor.spin_once(timeout_sec=TURN_S)
            turns -= 1

    def reasons(self, node):
        """Return {thing: (reason code, sentence)} of a node's diagnostics."""
        return {status.name.partition(': ')[2]: (
            next(v.value for v in status.values if v.key == 'reason'), status.message)
            for status in node.diagnostics.statuses()}


@pytest.fixture
def bench():
    """Return a Bench."""
    rclpy = pytest.importorskip('rclpy')
    from hooc_perception.supervisor.environment import claim_domain
    domain, claim = claim_domain()
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=domain)
    bench = Bench(context)
    yield bench
    for node in (*bench.nodes, bench.peer):
        node.destroy_node()
    bench.executor.shutdown()
    rclpy.try_shutdown(context=context)
    claim.close()


@pytest.fixture
def cheap():
    """Return parameters of nodes that do as little work as they can be told to."""
    return {
        'candidate_node': {'propose.samples': 300, 'propose.pool': 10, 'propose.refine_steps': 5,
                           'propose.polish': 2, 'propose.polish_steps': 2,
                           'propose.per_category': 2},
        'parsing_node': {'parse.rounds': 0, 'parse.polish_steps': 0, 'parse.patience': 0,
                         'parse.finalists': 1}}


class Stages:
    """Stages that note their input and answer from it, so that one wrong bit spreads."""

    def __init__(self, scene):
        self.views, self.p, self.candidates, self.models = scene
        self.given, self.chosen, self.refuse, self.turns = {}, [0, 2], None, ()

    def install(self, monkeypatch):
        """Stand in for the stages of every Parser with the joint method."""
        monkeypatch.setattr(Parser, 'classify', lambda _, observation: self.classify(observation))
        monkeypatch.setattr(JointMethod, 'propose', lambda _, *args: self.propose(*args))
        monkeypatch.setattr(JointMethod, 'parse', lambda *args: self.parse(*args))

    def classify(self, observation):
        self.given['classify'] = observation,
        self.refuse_in('classify')
        return self.p

    def propose(self, frame, seed):
        self.given['propose'] = frame.observation, frame.probabilities, frame.models, seed
        self.refuse_in('propose')
        pool = self.candidates
        return type(pool)(pool.category, pool.translation * 1.0000001, pool.rotation_xyzw,
                          pool.size, pool.score)

    def parse(self, method, frame, pool, seed, max_instances=0):
        self.asked = [method.propose_more(frame, pool.take(self.chosen), turn, seed)
                      for turn in self.turns]
        self.given['parse'] = frame.observation, frame.probabilities, pool, seed, max_instances
        self.refuse_in('parse')
        n = len(self.chosen)
        return ParsedScene(pool.take(self.chosen), Energy(0.5, 0.25, 0.125),
                           np.full(n, 0.9, np.float32), np.full(n, 0.01, np.float32),
                           np.full(n, 3.0, np.float32), np.full(n, 2, np.uint8), pool)

    def refuse_in(self, stage):
        """Raise what `refuse` = (stage, error) names for this stage."""
        if self.refuse and self.refuse[0] == stage:
            raise self.refuse[1]


@pytest.fixture(scope='session')
def make_folder(tmp_path_factory):
    """Return a function that saves {category: mesh} as a ModelFolder, seen by one camera."""
    def make(meshes):
        rng = np.random.default_rng(0)
        models = [derive(name, mesh, rng, 200, 100) for name, mesh in meshes.items()]
        return save_model_folder(tmp_path_factory.mktemp('model') / 'm', 'm', models,
                                 {'kind': np.zeros(1)}, 'fast', 3, (overhead_camera(),), 1)
    return make


@pytest.fixture(scope='session')
def folder(make_folder):
    """Return the ModelFolder of three simple things."""
    return make_folder({'box': trimesh.creation.box((0.1, 0.06, 0.08)),
                        'ball': trimesh.creation.icosphere(2, 0.05),
                        'can': trimesh.creation.cylinder(0.04, 0.12)})


@pytest.fixture
def make_chain(bench, folder, monkeypatch):
    """
    Return a function that brings up the four nodes with Stages instead of the real ones.

    It takes the names of the cameras and {node: parameters}, puts the active nodes into
    `bench.chain` and returns (stages, function that sends images of one stamp). Each frame set is
    decided by itself unless `incremental` says otherwise: the images are always the same.
    """
    from geometry_msgs.msg import TransformStamped
    from hooc_perception.nodes import (
        candidate_node,
        classification_node,
        ingestion_node,
        parsing_node,
    )
    from hooc_perception.ros.messages import conversions as c
    from hooc_perception.ros.qos import qos
    from rclpy.lifecycle import TransitionCallbackReturn
    from sensor_msgs.msg import CameraInfo, Image
    kinds = (ingestion_node.IngestionNode, classification_node.ClassificationNode,
             candidate_node.CandidateNode, parsing_node.ParsingNode)

    def make(names=('overhead',), parameters=None, active=range(4)):
        cameras = {name: replace(overhead_camera(), name=name) for name in names}
        stages = Stages(made_up_scene(folder.models, tuple(cameras.values())))
        stages.install(monkeypatch)
        common = {'model': str(folder.path), 'cameras': list(names), 'seed': 5, 'warm_up': False,
                  'incremental': False}
        bench.chain = [bench.add(kind, **{**common, **(parameters or {}).get(i, {})})
                       for i, kind in enumerate(kinds)]
        peer, topics = bench.peer, {}
        for name in names:
            topics[name] = [peer.create_publisher(kind, f'{name}/{suffix}',
                                                  qos(f'<camera>/{suffix}'))
                            for kind, suffix in ((CameraInfo, 'depth/camera_info'),
                                                 (Image, 'depth/image_raw'),
                                                 (TransformStamped, 'extrinsics'))]
        for i, node in enumerate(bench.chain):
            assert node.trigger_configure() == TransitionCallbackReturn.SUCCESS, (
                bench.reasons(node))
            if i in active:
                assert node.trigger_activate() == TransitionCallbackReturn.SUCCESS
        for name, (infos, images, poses) in topics.items():
            poses.publish(c.transform_message(
                *pose_from_matrix(cameras[name].T_world_camera), c.header(0, 'table'),
                f'{name}_optical'))
            assert bench.spin(lambda: images.get_subscription_count()
                              and infos.get_subscription_count() and peer.count_subscribers(
                                  f'/hooc/views/{name}/depth_rect') == 3)
        bench.rest(0.3)

        def send(shift_s=0.0, only=names, stamp=None, empty=False):
            stamp = stamp or peer.get_clock().now().nanoseconds + int(shift_s * 1e9)
            for name in only:
                head = c.header(stamp, f'{name}_optical')
                topics[name][0].publish(c.camera_info_message(cameras[name], head))
                view = stages.views[names.index(name)]
                depth = observe([view]).views[0].background if empty else view.depth
                topics[name][1].publish(c.depth_message(depth, head))
            return stamp
        return stages, send
    return make


@pytest.fixture
def live(bench, make_chain):
    """
    Return a function that brings up the four nodes so that their answers follow the frame sets.

    It takes parameters of the parsing node and returns (stages, function that sends images and
    returns the next answer).
    """
    from geometry_msgs.msg import PoseArray
    from hooc_perception.ros.qos import qos

    def make(**parsing):
        parameters = {i: {'incremental': True} for i in range(4)}
        parameters[0]['max_frame_age_s'] = 0.0
        parameters[3].update(parsing)
        stages, send = make_chain(parameters=parameters)
        answers = bench.hear(PoseArray, 'objects/poses', qos('objects/poses'))

        def answer(**given):
            before = len(answers)
            send(**given)
            assert bench.spin(lambda: len(answers) > before), [
                bench.reasons(node) for node in bench.chain]
            return answers[-1]
        return stages, answer
    return make


@pytest.fixture
def chain(bench, make_chain):
    """Return (stages, bench with the active chain, function that sends one frame set)."""
    stages, send = make_chain()
    return stages, bench, send

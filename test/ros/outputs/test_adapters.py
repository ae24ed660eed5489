# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""tf2, vision_msgs and MoveIt get what their definitions say, on machines without them, too."""

from dataclasses import replace
import importlib.util
from pathlib import Path
import sys
from types import SimpleNamespace

from hooc_perception.errors import HoocError
import numpy as np
import pytest

pytest.importorskip('rclpy')

from geometry_msgs.msg import Point32, PolygonStamped  # noqa: E402
from hooc_perception.core.types import Candidates, Energy, ParsedScene
from hooc_perception.ros.messages.conversions import header
from hooc_perception.ros.outputs.adapters.choose import AdapterConfig, adapters_of
from hooc_perception.ros.outputs.adapters.detections import covariance
from hooc_perception.ros.outputs.adapters.guard import messages_of
from hooc_perception.ros.outputs.detected import detected_scene, DetectedScene, DetectedUnknown
import trimesh  # noqa: E402

STAMP = 1_700_000_000_250_000_000
HALF = 0.5 ** 0.5


@pytest.fixture
def stubs(monkeypatch):
    """Return stub_messages.py with `install(package)` for this test."""
    spec = importlib.util.spec_from_file_location(
        'stub_messages', Path(__file__).parents[1] / 'stub_messages.py')
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return SimpleNamespace(DEFINITIONS=module.DEFINITIONS, make=module.make, cdr=module.cdr,
                           install=lambda package: module.install(monkeypatch, package))


@pytest.fixture
def scene():
    """Return the DetectedScene of a box and a can that lies."""
    from hooc_perception.objects.derive import derive
    rng = np.random.default_rng(0)
    models = (derive('tea box', trimesh.creation.box((0.1, 0.06, 0.08)), rng, 50, 50),
              derive('can', trimesh.creation.cylinder(0.03, 0.1, sections=8), rng, 50, 50))
    objects = Candidates(np.array([1, 2], np.uint16),
                         np.array([[0.1, 0.2, 0.04], [-0.3, 0, 0.03]]),
                         np.array([[0, 0, 0, 1.0], [HALF, 0, 0, HALF]]),
                         np.array([[0.2, 0.06, 0.08], models[1].extents], np.float32),
                         np.array([0.75, 0.5], np.float32))
    some = np.ones(2, np.float32)
    parsed = ParsedScene(objects, Energy(0, 0, 0), some, some, some, np.ones(2, np.uint8), objects)
    return detected_scene(parsed, np.array([7, 9], np.uint32), models, STAMP, 'table')


class Node:
    """A StageNode as the adapters see it: publishers that keep what they are given."""

    def __init__(self, **config):
        self.config = SimpleNamespace(**{**vars(AdapterConfig()), 'target_frame': 'table',
                                         **config})
        self.now, self.active, self.sent, self.timers = STAMP, True, {}, []

    def now_ns(self):
        return self.now

    def publisher(self, kind, topic):
        from hooc_perception.chain import TOPICS
        assert topic in TOPICS
        return SimpleNamespace(publish=self.sent.setdefault(topic, []).append)

    def subscription(self, kind, topic, callback):
        self.hear = {**getattr(self, 'hear', {}), topic: callback}

    def create_timer(self, period, callback):
        self.timers.append(callback)

    def owned(self, destroy, made):
        return made

    def guarded(self, callback, thing, loss):
        return callback

    destroy_timer = None


def xyz(v):
    return (v.x, v.y, v.z)


def test_what_is_not_installed_is_off_by_default(monkeypatch):
    for package in ('tf2_msgs', 'vision_msgs', 'moveit_msgs'):
        monkeypatch.setitem(sys.modules, f'{package}.msg', None)
    node = Node()
    assert adapters_of(node) == [] and node.sent == {}


def test_what_is_installed_is_on_by_default(stubs):
    for package in ('tf2_msgs', 'vision_msgs', 'moveit_msgs'):
        stubs.install(package)
    assert [type(a).__name__ for a in adapters_of(Node())] == ['ObjectFrames', 'Detections']
    assert adapters_of(Node(publish_tf='off', publish_detections='off')) == []


@pytest.mark.parametrize('parameter, value, package', [
    ('publish_tf', 'on', 'tf2_msgs'), ('publish_detections', 'on', 'vision_msgs'),
    ('planning_scene', 'mesh', 'moveit_msgs')])
def test_a_missing_package_is_named(parameter, value, package, stubs, monkeypatch):
    stubs.install(package)      # another test may have imported the real one
    for module in (package, f'{package}.msg'):
        monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(HoocError, match=f'{parameter} needs the package {package}.*ros-jazzy-'
                       + package.replace('_', '-')):
        adapters_of(Node(**{parameter: value}))


def test_tf_has_a_frame_an_object(stubs, scene):
    stubs.install('tf2_msgs')
    node = Node(publish_tf='on')
    adapter, = adapters_of(node)
    adapter.publish(scene)
    message, = node.sent['/tf']
    _, read = stubs.cdr(message)
    box, can = read.transforms
    assert (box.header.frame_id, box.child_frame_id) == ('table', 'tea_box_7')
    assert can.child_frame_id == 'can_9'
    assert (can.header.stamp.sec, can.header.stamp.nanosec) == (1_700_000_000, 250_000_000)
    assert xyz(can.transform.translation) == (-0.3, 0, 0.03)
    q = can.transform.rotation
    assert (q.x, q.y, q.z, q.w) == (HALF, 0, 0, HALF)
    adapter.publish(DetectedScene(STAMP, 'table', ()))
    assert len(node.sent['/tf']) == 1


def test_detections_golden(stubs, scene):
    stubs.install('vision_msgs')
    node = Node(publish_detections='on')
    adapter, = adapters_of(node)
    adapter.publish(scene)
    data, read = stubs.cdr(node.sent['objects/detections'][0])
    assert read.header.frame_id == 'table' and len(read.detections) == 2
    box = read.detections[0]
    assert box.header == read.header and box.id == '7'
    assert xyz(box.bbox.center.position) == (0.1, 0.2, 0.04)
    np.testing.assert_allclose(xyz(box.bbox.size), (0.2, 0.06, 0.08), atol=1e-7)
    result, = box.results
    assert (result.hypothesis.class_id, result.hypothesis.score) == ('tea box', 0.75)
    assert result.pose.pose == box.bbox.center
    assert not result.pose.covariance.any()         # all zeros: unknown
    # Header, two detections with 36 covariances each and little else.
    assert 2 * 36 * 8 < len(data) < 1200
    adapter.clear(STAMP + 1, 'table')
    assert stubs.cdr(node.sent['objects/detections'][1])[1].detections == []


def test_covariance_holds_68_percent_within_sigma():
    full = covariance(0.006, 0.03).reshape(6, 6)
    errors = np.random.default_rng(0).multivariate_normal(np.zeros(6), full, 20000)
    assert (np.linalg.norm(errors[:, :3], axis=1) < 0.006).mean() == pytest.approx(0.68, abs=0.01)
    assert (np.linalg.norm(errors[:, 3:], axis=1) < 0.03).mean() == pytest.approx(0.68, abs=0.01)
    assert not (full - np.diag(np.diag(full))).any()
    assert not covariance(0.006, float('nan')).any() and not covariance(0.006, np.inf).any()


@pytest.mark.parametrize('shape', ['mesh', 'box'])
def test_planning_scene_golden(stubs, scene, shape):
    stubs.install('moveit_msgs')
    node = Node(planning_scene=shape)
    adapter, = adapters_of(node)
    adapter.publish(scene)
    _, read = stubs.cdr(node.sent['/planning_scene'][0])
    # Without the second flag MoveIt takes the empty joint state for the robot's.
    assert read.is_diff and read.robot_state.is_diff
    box, can = read.world.collision_objects
    assert (box.id, box.type.key, box.operation) == ('tea_box_7', 'tea box', 0)
    assert box.header.frame_id == 'table'
    assert xyz(box.pose.position) == (0.1, 0.2, 0.04) and box.pose.orientation.w == 1
    if shape == 'box':
        assert not box.meshes and box.primitives[0].type == 1      # SolidPrimitive.BOX
        np.testing.assert_allclose(box.primitives[0].dimensions, (0.2, 0.06, 0.08), atol=1e-7)
        assert box.primitive_poses[0].orientation.w == 1
        return
    assert not box.primitives and box.mesh_poses[0].orientation.w == 1
    vertices = np.array([xyz(v) for v in box.meshes[0].vertices])
    np.testing.assert_allclose(np.ptp(vertices, axis=0), (0.2, 0.06, 0.08), atol=1e-7)
    triangles = np.array([t.vertex_indices for t in box.meshes[0].triangles])
    mesh = trimesh.Trimesh(vertices, triangles)
    assert mesh.is_watertight and mesh.volume == pytest.approx(0.2 * 0.06 * 0.08, rel=1e-5)


def told(stubs, node):
    """Return [(id, operation)] of each diff that was sent."""
    return [[(o.id, o.operation) for o in stubs.cdr(m)[1].world.collision_objects]
            for m in node.sent['/planning_scene']]


def later(node, scene, seconds, keep):
    node.now += int(seconds * 1e9)
    return DetectedScene(node.now, 'table', tuple(scene.objects[i] for i in keep))


def test_what_is_gone_leaves_the_planning_scene_after_its_time(stubs, scene):
    stubs.install('moveit_msgs')
    node = Node(planning_scene='box', planning_scene_ttl_s=5.0)
    adapter, = adapters_of(node)
    adapter.publish(scene)
    adapter.publish(later(node, scene, 3, [0]))
    adapter.publish(later(node, scene, 3, [0]))
    adapter.publish(later(node, scene, 1, []))
    box, can = ('tea_box_7', 0), ('can_9', 0)
    assert told(stubs, node) == [[box, can], [box], [('can_9', 1), box]]
    # No answers any more: what is known grows old.
    timer, = node.timers
    node.now += 3 * 10 ** 9
    timer()
    assert len(node.sent['/planning_scene']) == 3
    node.now += 2 * 10 ** 9
    timer()
    assert told(stubs, node)[3:] == [[('tea_box_7', 1)]]
    timer()
    adapter.clear(node.now, 'table')
    assert len(node.sent['/planning_scene']) == 4


def test_hidden_objects_stay_in_the_planning_scene_in_another_colour(stubs, scene):
    stubs.install('moveit_msgs')
    node = Node(planning_scene='box', planning_scene_ttl_s=5.0)
    adapter, = adapters_of(node)
    box, can = scene.objects
    adapter.publish(scene)
    for seconds in (4, 8, 12):
        node.now += 4 * 10 ** 9
        adapter.publish(replace(scene, stamp_ns=node.now, objects=(
            box, replace(can, hidden_s=float(seconds)))))
    node.now += 10 ** 9
    adapter.publish(replace(scene, stamp_ns=node.now))
    assert told(stubs, node) == [[('tea_box_7', 0), ('can_9', 0)]] * 5
    colors = [[(c.id, c.color.a) for c in m.object_colors] for m in node.sent['/planning_scene']]
    assert colors[0] == [] and colors[1] == colors[3] and colors[4] == [('can_9', 1.0)]
    (name, alpha), = colors[1]
    assert name == 'can_9' and alpha < 0.9


def test_at_once_on_clear_and_when_time_was_set_back(stubs, scene):
    stubs.install('moveit_msgs')
    node = Node(planning_scene='box', planning_scene_ttl_s=0.0)
    adapter, = adapters_of(node)
    adapter.publish(scene)
    adapter.publish(later(node, scene, 0.1, [1]))
    assert told(stubs, node)[1] == [('tea_box_7', 1), ('can_9', 0)]
    adapter.publish(later(node, scene, -100, [0]))
    assert told(stubs, node)[2] == [('can_9', 1), ('tea_box_7', 0)]
    adapter.clear(node.now, 'table')
    assert told(stubs, node)[3] == [('tea_box_7', 1)]


def test_a_bag_that_starts_again_leaves_no_ghosts(stubs, scene):
    """The stamps are set back, the clock of the node is not."""
    stubs.install('moveit_msgs')
    node = Node(planning_scene='box')
    adapter, = adapters_of(node)
    adapter.publish(scene)
    again = replace(scene, stamp_ns=STAMP - 10 ** 9, objects=tuple(
        replace(o, id=o.id + 10) for o in scene.objects))
    adapter.publish(again)
    assert told(stubs, node)[1] == [('can_9', 1), ('tea_box_7', 1), ('tea_box_17', 0),
                                    ('can_19', 0)]
    adapter.clear(node.now, 'table')
    assert told(stubs, node)[2] == [('tea_box_17', 1), ('can_19', 1)]


def test_real_packages_have_the_fields_of_the_stubs(stubs):
    """Where a ROS installation is, its own classes are held against the definitions."""
    missing = []
    for name in stubs.DEFINITIONS:
        package, _, kind = name.split('/')
        try:
            real = getattr(messages_of(package, 'a test'), kind)
        except HoocError:
            missing.append(name)
            continue
        stub = stubs.make(name)
        assert list(real.get_fields_and_field_types()) == list(stub.__slots__)
    if len(missing) == len(stubs.DEFINITIONS):
        pytest.skip('none of the packages is installed')


def outline(*corners):
    """Return the message of scene/table with these corners in base_link."""
    message = PolygonStamped(header=header(STAMP, 'base_link'))
    message.polygon.points = [Point32(x=x, y=y, z=z) for x, y, z in corners]
    return message


def test_the_table_is_a_closed_slab_below_its_surface(stubs):
    stubs.install('moveit_msgs')
    node = Node(planning_scene='box')
    adapters_of(node)
    node.hear['scene/table'](outline((0.0, 0.0, 0.7), (1.0, 0.0, 0.7), (1.0, 0.8, 0.72),
                                     (0.2, 0.9, 0.7225), (0.0, 0.5, 0.7125)))
    _, read = stubs.cdr(node.sent['/planning_scene'][0])
    slab, = read.world.collision_objects
    assert (slab.id, slab.operation, slab.header.frame_id) == ('table', 0, 'base_link')
    mesh = trimesh.Trimesh([xyz(v) for v in slab.meshes[0].vertices],
                           [t.vertex_indices for t in slab.meshes[0].triangles], process=False)
    assert mesh.is_watertight and mesh.is_winding_consistent
    assert mesh.volume == pytest.approx(0.03 * 0.82, rel=0.01)      # outwards: positive
    assert mesh.bounds[1, 2] == pytest.approx(0.7225 - 0.005, abs=1e-3)
    # Results come and go, the table stays.
    node.hear['scene/table'](outline())
    assert len(node.sent['/planning_scene']) == 1


def test_the_table_can_be_left_out(stubs):
    stubs.install('moveit_msgs')
    node = Node(planning_scene='box', planning_scene_table=False)
    adapters_of(node)
    assert not hasattr(node, 'hear')


@pytest.mark.parametrize('shape', ['mesh', 'box'])
def test_things_of_no_category_are_obstacles(stubs, scene, shape):
    stubs.install('moveit_msgs')
    node = Node(planning_scene=shape, planning_scene_ttl_s=0.0)
    adapter, = adapters_of(node)
    body = trimesh.creation.box((0.1, 0.2, 0.06))
    thing = DetectedUnknown(11, 0.7, np.array([0.3, -0.3, 0.03]), np.array([0, 0, 0, 1.0]),
                            np.array([0.1, 0.2, 0.06]),
                            np.array(body.vertices) + [0.3, -0.3, 0.03])
    adapter.publish(replace(scene, unknown=(thing,)))
    _, read = stubs.cdr(node.sent['/planning_scene'][0])
    found = read.world.collision_objects[-1]
    assert (found.id, found.type.key, found.operation) == ('unknown_11', 'unknown', 0)
    if shape == 'box':
        np.testing.assert_allclose(found.primitives[0].dimensions, (0.1, 0.2, 0.06))
        assert xyz(found.pose.position) == (0.3, -0.3, 0.03)
    else:
        mesh = trimesh.Trimesh([xyz(v) for v in found.meshes[0].vertices],
                               [t.vertex_indices for t in found.meshes[0].triangles],
                               process=False)
        assert mesh.is_watertight and mesh.volume == pytest.approx(0.0012)      # outwards
        np.testing.assert_allclose(mesh.bounds.mean(0), [0.3, -0.3, 0.03])
    adapter.publish(later(node, scene, 1, [0, 1]))
    _, read = stubs.cdr(node.sent['/planning_scene'][1])
    assert ('unknown_11', 1) in [(o.id, o.operation) for o in read.world.collision_objects]

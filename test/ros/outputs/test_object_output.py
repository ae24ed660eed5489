# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Every output of the parsing node shows the mesh that was found."""

from dataclasses import replace
import json
from types import SimpleNamespace

from hooc_perception.core.parsing.unexplained import Reason, Unexplained
from hooc_perception.core.types import Candidates, Energy, ParsedScene, UnknownObjects
from hooc_perception.objects.derive import derive
import numpy as np
import pytest

pytest.importorskip('rclpy')

from hooc_perception.ros.messages.point_clouds import cloud_rows
from hooc_perception.ros.messages.unknown import unknown_from_messages
from hooc_perception.ros.outputs.detect_service import scene_json
from hooc_perception.ros.outputs.detected import detected_scene
from hooc_perception.ros.outputs.object_output import ObjectOutput
import trimesh  # noqa: E402

STAMP = 1_700_000_000_250_000_000
LEFT = Unexplained(np.array([[0.1, 0.2, 0.3]]), np.array([Reason.RESIDUE], np.uint8))
MESHES = [[('file:///pan.ply', 'p0'), ('file:///pan.1.ply', 'p1')], [('file:///can.ply', 'c0')]]


@pytest.fixture(scope='module')
def models():
    """Return a family of two boxes, and a can."""
    rng = np.random.default_rng(0)
    low, high, can = (derive('x', mesh, rng, 50, 50) for mesh in (
        trimesh.creation.box((0.2, 0.1, 0.03)), trimesh.creation.box((0.2, 0.1, 0.12)),
        trimesh.creation.cylinder(0.03, 0.1)))
    return (replace(low, name='pan', variants=(replace(high, name='pan'),)),
            replace(can, name='can'))


@pytest.fixture
def parsed():
    """Return the ParsedScene of a low pan, a high pan and a can, all 0.4 x 0.1 x 0.12 m."""
    objects = Candidates(
        np.array([1, 1, 2], np.uint16), np.array([[0, 0, 0.06], [0.5, 0, 0.06], [0, 0.5, 0.06]]),
        np.tile([0, 0, 0, 1.0], (3, 1)), np.tile(np.float32([0.4, 0.1, 0.12]), (3, 1)),
        np.ones(3, np.float32), np.array([0, 1, 0], np.uint16))
    some = np.ones(3, np.float32)
    return ParsedScene(objects, Energy(0, 0, 0), some, some, some, np.ones(3, np.uint8), objects)


@pytest.fixture
def sent(models, parsed):
    """Return {topic: messages} of its publication under the ids 7, 8, 9."""
    topics = {}
    node = SimpleNamespace(publisher=lambda kind, topic, name=None: SimpleNamespace(
        publish=topics.setdefault(name or topic, []).append))
    output = ObjectOutput(node, models, MESHES)
    scene = detected_scene(parsed, np.array([7, 8, 9], np.uint32), models, STAMP, 'table')
    output.publish(parsed, scene, 0.1, LEFT)
    return topics


def test_what_is_unexplained_comes_with_its_reason(sent):
    row, = cloud_rows(sent['scene/unexplained'][0])
    assert (row['reason'], round(float(row['z']), 6)) == (Reason.RESIDUE, 0.3)


def test_markers_have_the_mesh_of_the_member_at_its_scale(sent):
    markers = sent['objects/markers'][0].markers
    assert [(m.ns, m.id, m.mesh_resource) for m in markers] == [
        ('pan', 7, 'file:///pan.ply'), ('pan', 8, 'file:///pan.1.ply'),
        ('can', 9, 'file:///can.ply')]
    scale = [[m.scale.x, m.scale.y, m.scale.z] for m in markers]
    np.testing.assert_allclose(scale[:2], [[2, 1, 4], [2, 1, 1]], rtol=1e-6)


def test_labels_tell_the_mesh_of_each_object(sent):
    labels = json.loads(sent['objects/labels'][0].data)
    assert {key: (thing['member'], thing['mesh'], thing['sha256'])
            for key, thing in labels['objects'].items()} == {
        '7': (0, 'file:///pan.ply', 'p0'), '8': (1, 'file:///pan.1.ply', 'p1'),
        '9': (0, 'file:///can.ply', 'c0')}
    pan = labels['classes']['1']
    assert [m['mesh'] for m in pan['members']] == ['file:///pan.ply', 'file:///pan.1.ply']
    assert (pan['mesh'], pan['extents_m']) == ('file:///pan.ply', [0.2, 0.1, 0.03])
    assert pan['members'][1]['extents_m'] == [0.2, 0.1, 0.12]


def test_adapters_and_the_service_get_the_mesh_of_the_member(models, parsed):
    scene = detected_scene(parsed, np.array([7, 8, 9]), models, STAMP, 'table')
    assert [o.member for o in scene.objects] == [0, 1, 0]
    assert [o.name for o in scene.objects] == ['pan_7', 'pan_8', 'can_9']
    assert scene.objects[0].model is models[0]
    assert scene.objects[1].model is models[0].variants[0]
    assert [o['member'] for o in json.loads(scene_json(scene))['objects']] == [0, 1, 0]


@pytest.fixture
def open_scene(parsed):
    """Return the same ParsedScene beside something of no category."""
    box = trimesh.creation.box((0.1, 0.2, 0.06))
    return replace(parsed, unknown=UnknownObjects(
        np.array([[0.3, -0.3, 0.03]]), np.array([[0, 0, 0.6, 0.8]]),
        np.float32([[0.1, 0.2, 0.06]]), np.float32([0.7]),
        (np.array(box.vertices) + [0.3, -0.3, 0.03],)))


def test_things_of_no_category_have_topics_and_markers_of_their_own(models, parsed, open_scene):
    topics = {}
    node = SimpleNamespace(publisher=lambda kind, topic, name=None: SimpleNamespace(
        publish=topics.setdefault(name or topic, []).append))
    output = ObjectOutput(node, models, MESHES)
    known = np.array([7, 8, 9], np.uint32)
    scene = detected_scene(open_scene, known, models, STAMP, 'table', np.array([11], np.uint32))
    output.publish(open_scene, scene, 0.1, LEFT)
    poses, attributes = topics['objects/unknown'][0], topics['objects/unknown_attributes'][0]
    assert poses.header.frame_id == 'table' and len(topics['objects/poses'][0].poses) == 3
    assert poses.poses[0].position.y == -0.3
    row, = cloud_rows(attributes)
    assert (row['id'], round(float(row['score']), 6)) == (11, 0.7)
    np.testing.assert_allclose([row['size_x'], row['size_y'], row['size_z'], row['age_s']],
                               [0.1, 0.2, 0.06, 0.1], rtol=1e-6)
    again = unknown_from_messages(poses, attributes)
    np.testing.assert_array_equal(again.size, open_scene.unknown.size)
    marker = next(m for m in topics['objects/markers'][0].markers if m.ns == 'unknown')
    assert (marker.id, marker.type, marker.scale.y) == (11, marker.CUBE, pytest.approx(0.2))
    thing, = json.loads(scene_json(scene))['unknown']
    assert thing['id'] == 11 and thing['size'] == pytest.approx([0.1, 0.2, 0.06])
    # It goes as it came: its marker, and its row.
    output.publish(parsed, detected_scene(parsed, known, models, STAMP + 1, 'table'), 0.1,
                   LEFT)
    assert topics['objects/unknown'][1].poses == []
    assert [(m.id, m.action) for m in topics['objects/markers'][1].markers
            if m.ns == 'unknown'] == [(11, marker.DELETE)]
    output.clear(STAMP + 2, 'table')
    assert topics['objects/unknown'][2].poses == []
    assert topics['objects/unknown_attributes'][2].width == 0

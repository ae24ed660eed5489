# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What travels between the stages arrives as it was sent, also read by foreign means."""

from dataclasses import replace
import json
import struct

from hooc_perception.core.types import (
    Camera,
    Candidates,
    Energy,
    Observation,
    ObservedView,
    ParsedScene,
    PixelProbabilities,
)
from hooc_perception.errors import HoocError
import numpy as np
import pytest

pytest.importorskip('rclpy')

from hooc_perception.ros.messages import stages as s
from hooc_perception.ros.messages.conversions import header
from hooc_perception.ros.messages.point_clouds import cloud_message, cloud_rows, row_dtype
from rclpy.serialization import deserialize_message, serialize_message  # noqa: E402


def sent(message):
    return deserialize_message(serialize_message(message), type(message))


def some_candidates(n, seed=0, classes=3):
    rng = np.random.default_rng(seed)
    q = rng.normal(size=(n, 4))
    return Candidates(rng.integers(1, classes + 1, n).astype(np.uint16), rng.normal(size=(n, 3)),
                      q / np.linalg.norm(q, axis=1, keepdims=True),
                      rng.random((n, 3)).astype(np.float32), rng.random(n).astype(np.float32),
                      rng.integers(0, 4, n).astype(np.uint16))


def same(a, b):
    for name in ('category', 'translation', 'rotation_xyzw', 'size', 'score', 'member'):
        assert getattr(a, name).dtype == getattr(b, name).dtype, name
        assert getattr(a, name).tobytes() == getattr(b, name).tobytes(), name


def an_observation():
    camera = Camera('a', 6, 4, np.array([[5., 0, 2.5], [0, 5, 1.5], [0, 0, 1]]), np.zeros(5),
                    np.eye(4))
    depth = np.full((4, 6), 2, np.float32)
    depth[0, 0] = np.nan
    view = ObservedView(camera, depth, depth, depth > 0, depth > 0)
    return Observation((view, view), 0.002)


def some_probabilities(n=10, classes=3):
    rng = np.random.default_rng(4)
    return PixelProbabilities(
        np.sort(rng.integers(0, 2, n)).astype(np.uint8),
        np.stack([rng.integers(0, 6, n), rng.integers(0, 4, n)], -1).astype(np.uint16),
        rng.integers(0, 256, (n, classes + 1)).astype(np.uint8))


def foreign_value(message, row, name):
    """Read one number with nothing but the message's own description of itself."""
    field = next(f for f in message.fields if f.name == name)
    code = {2: 'B', 4: 'H', 6: 'I', 7: 'f'}[field.datatype]
    return struct.unpack_from('<' + code, bytes(message.data),
                              row * message.point_step + field.offset)[0]


@pytest.mark.parametrize('n', [0, 1, 200])
def test_candidates_pass_unchanged(n):
    candidates = some_candidates(n)
    poses, attributes = s.candidates_messages(candidates, header(9, 'table'))
    same(s.candidates_from_messages(sent(poses), sent(attributes)), candidates)


def without_members(attributes):
    """Return a cloud of candidates as nodes wrote it before there were families."""
    rows = cloud_rows(attributes)
    older = np.zeros(len(rows), row_dtype(
        [c for c in s.CANDIDATE_COLUMNS if c[0] != 'member']))
    for name in older.dtype.names:
        older[name] = rows[name]
    return cloud_message(older, attributes.header)


@pytest.mark.parametrize('n', [0, 5])
def test_messages_without_members_are_of_the_generic_meshes(n):
    candidates = some_candidates(n)
    poses, attributes = s.candidates_messages(candidates, header(9, 'table'))
    again = s.candidates_from_messages(sent(poses), sent(without_members(attributes)), [4, 1, 4])
    same(again, replace(candidates, member=np.zeros(n, np.uint16)))


def test_ids_outside_of_the_model_are_refused():
    candidates = replace(some_candidates(4), category=np.array([1, 2, 3, 3], np.uint16),
                         member=np.array([0, 1, 0, 2], np.uint16))
    messages = s.candidates_messages(candidates, header(9, 'table'))
    same(s.candidates_from_messages(*messages, [1, 2, 3]), candidates)
    with pytest.raises(HoocError, match='category outside of the 2.*same folder in all nodes'):
        s.candidates_from_messages(*messages, [1, 2])
    for families in ([1, 1, 3], [1, 2, 2], [9, 9, 1]):
        with pytest.raises(HoocError, match='member outside.*same folder in all nodes'):
            s.candidates_from_messages(*messages, families)


@pytest.mark.parametrize('column, value', [('member', np.nan), ('member', -1.0),
                                           ('category', np.nan)])
def test_ids_of_another_type_lead_nowhere_else(column, value):
    poses, attributes = s.candidates_messages(some_candidates(2, classes=1), header(9, 'table'))
    known = cloud_rows(attributes)
    rows = np.zeros(2, row_dtype([(name, 'f4') for name, _ in s.CANDIDATE_COLUMNS]))
    for name in rows.dtype.names:
        rows[name] = known[name]
    rows[column][1] = value
    with pytest.raises(HoocError, match=column):
        s.candidates_from_messages(poses, cloud_message(rows, attributes.header), [4])


def test_rows_and_poses_that_do_not_belong_together():
    poses, _ = s.candidates_messages(some_candidates(3), header(9, 'table'))
    _, fewer = s.candidates_messages(some_candidates(2), header(9, 'table'))
    _, later = s.candidates_messages(some_candidates(3), header(10, 'table'))
    for attributes in (fewer, later):
        with pytest.raises(HoocError, match='two nodes'):
            s.candidates_from_messages(poses, attributes)


@pytest.mark.parametrize('n', [0, 10])
def test_probabilities_pass_unchanged(n):
    probabilities = some_probabilities(n)
    message = sent(s.probabilities_message(probabilities, an_observation(), 'xyz', header(1, 't')))
    again = s.probabilities_from_message(message)
    for name in ('camera', 'uv', 'p'):
        assert getattr(again, name).dtype == getattr(probabilities, name).dtype
        np.testing.assert_array_equal(getattr(again, name), getattr(probabilities, name))
    assert [f.name for f in message.fields] == [
        'camera', 'u', 'v', 'x', 'y', 'z', 'p_background', 'p_x', 'p_y', 'p_z']


def test_probabilities_carry_the_points():
    probabilities = PixelProbabilities(np.array([1], np.uint8), np.array([[4, 3]], np.uint16),
                                       np.zeros((1, 2), np.uint8))
    message = s.probabilities_message(probabilities, an_observation(), ['cup'], header(1, 't'))
    point = [foreign_value(message, 0, name) for name in 'xyz']
    assert point == pytest.approx([(4 - 2.5) / 5 * 2, (3 - 1.5) / 5 * 2, 2.0])


def test_probabilities_of_another_model_are_refused():
    with pytest.raises(HoocError, match='train'):
        s.probabilities_message(some_probabilities(), an_observation(), ['cup'], header(1, 't'))


def test_label_images():
    probabilities = PixelProbabilities(
        np.array([0, 1], np.uint8), np.array([[5, 0], [2, 3]], np.uint16),
        np.array([[0, 10, 200], [250, 3, 2]], np.uint8))
    first, second = s.label_images(probabilities, an_observation())
    assert first[0, 5] == 2 and first.sum() == 2 and second.sum() == 0


def a_scene(n):
    rng = np.random.default_rng(n)
    f = lambda: rng.random(n).astype(np.float32)    # noqa: E731
    return ParsedScene(some_candidates(n), Energy(1.0, 2.0, 3.0), f(), f(), f(),
                       np.arange(n, dtype=np.uint8) % 4, some_candidates(30))


@pytest.mark.parametrize('n', [0, 5])
def test_objects_have_exactly_the_promised_columns(n):
    scene = a_scene(n)
    poses, attributes = s.objects_messages(scene, range(7, 7 + n), 0.25, header(9, 'table'))
    poses, attributes = sent(poses), sent(attributes)
    names = ('x y z qx qy qz qw score size_x size_y size_z visible_ratio residual_m '
             'energy_delta sigma_t sigma_r age_s id category n_views flags member').split()
    types = [7] * 17 + [6, 4, 2, 2, 4]
    assert [(f.name, f.datatype, f.count) for f in attributes.fields] == [
        (name, kind, 1) for name, kind in zip(names, types)]
    assert attributes.header == poses.header
    assert len(poses.poses) == attributes.width == n
    same(s.candidates_from_messages(poses, attributes), scene.objects)
    for i in range(n):
        assert foreign_value(attributes, i, 'id') == 7 + i
        assert foreign_value(attributes, i, 'category') == scene.objects.category[i]
        assert foreign_value(attributes, i, 'member') == scene.objects.member[i]
        assert foreign_value(attributes, i, 'energy_delta') == scene.energy_delta[i]
        assert foreign_value(attributes, i, 'n_views') == scene.n_views[i]
        assert foreign_value(attributes, i, 'age_s') == 0.25
        assert foreign_value(attributes, i, 'flags') == (2 if scene.n_views[i] == 1 else 0)
        assert np.isnan(foreign_value(attributes, i, 'sigma_t'))
        assert foreign_value(attributes, i, 'qw') == pytest.approx(
            poses.poses[i].orientation.w, abs=1e-6)


def test_columns_are_aligned_and_keep_their_order():
    dtype = row_dtype([('a', 'u1'), ('b', 'f8'), ('c', 'u2'), ('d', 'f4')])
    assert dtype.names == ('a', 'b', 'c', 'd')
    for name in dtype.names:
        kind, offset = dtype.fields[name][:2]
        assert offset % kind.itemsize == 0
    assert dtype.itemsize % 8 == 0


def test_big_endian_clouds_are_read():
    rows = np.zeros(3, row_dtype([('x', 'f4'), ('id', 'u4')]))
    rows['x'], rows['id'] = [1, 2, 3], [4, 5, 6]
    message = cloud_message(rows, header(0, ''))
    message.data = cloud_message(rows.byteswap(), header(0, '')).data
    message.is_bigendian = True
    np.testing.assert_array_equal(cloud_rows(message)['x'], rows['x'])
    np.testing.assert_array_equal(cloud_rows(message)['id'], rows['id'])


def test_clouds_without_what_is_needed():
    message = cloud_message(np.zeros(3, row_dtype([('x', 'f4')])), header(0, ''))
    with pytest.raises(HoocError, match='no field y'):
        cloud_rows(message, ['x', 'y'])
    message.width = 4
    with pytest.raises(HoocError, match='12 bytes'):
        cloud_rows(message)


def test_labels_name_classes_and_objects():
    class Model:
        def __init__(self, name, side=1, *variants):
            self.name, self.extents, self.symmetry = name, np.full(3, side), np.array([1, 2, 0])
            self.members = (self, *variants)
    meshes = [[('file:///a', 'aa')], [('file:///b', 'bb'), ('file:///b.1', 'b1')]]
    objects = replace(some_candidates(3), category=np.array([2, 1, 2], np.uint16),
                      member=np.array([0, 0, 1], np.uint16))
    content = json.loads(s.labels_json([Model('cup'), Model('ball', 1, Model('ball', 2))], meshes,
                                       [12, 13, 14], objects))
    cup, ball, large = (
        {'mesh': f'file:///{mesh}', 'sha256': digest, 'extents_m': [side] * 3,
         'symmetry': [1, 2, 0]}
        for mesh, digest, side in (('a', 'aa', 1), ('b', 'bb', 1), ('b.1', 'b1', 2)))
    assert content['classes'] == {'1': {'name': 'cup', **cup, 'members': [cup]},
                                  '2': {'name': 'ball', **ball, 'members': [ball, large]}}
    assert content['objects'] == {
        '12': {'category': 'ball', 'class_id': 2, 'member': 0, 'mesh': 'file:///b',
               'sha256': 'bb'},
        '13': {'category': 'cup', 'class_id': 1, 'member': 0, 'mesh': 'file:///a',
               'sha256': 'aa'},
        '14': {'category': 'ball', 'class_id': 2, 'member': 1, 'mesh': 'file:///b.1',
               'sha256': 'b1'}}

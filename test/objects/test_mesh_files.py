# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Units, up axes, compression and stray parts of mesh files."""

import json
import struct
import warnings

from hooc_perception.errors import HoocError, HoocWarning
from hooc_perception.objects import mesh_file
from hooc_perception.objects.mesh import load_mesh, mesh_box
import numpy as np
import pytest
import trimesh

# Right, depth and height of a box on a table, metres: z is up.
SIZE = (0.1, 0.06, 0.2)
DAE = """<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset>{asset}</asset>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="a" count="{count}">{numbers}</float_array>
<technique_common><accessor source="#a" count="{vertices}" stride="3">
<param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>
</accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="{faces}"><input semantic="VERTEX" source="#v" offset="0"/>
<p>{index}</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node><instance_geometry url="#g"/></node>
</visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene>
</COLLADA>"""


def box(size=SIZE, at=(0.0, 0.0, 0.0)):
    """Return a box that is wider to one side, so that its axes can be told apart."""
    mesh = trimesh.creation.box(size)
    mesh.vertices[mesh.vertices[:, 2] > 0] *= (0.5, 1, 1)
    mesh.apply_translation(at)
    return mesh


def saved(tmp_path, mesh, kind='ply'):
    path = tmp_path / f'thing.{kind}'
    mesh.export(path)
    return path


def collada(tmp_path, vertices, asset):
    pytest.importorskip('collada')
    mesh = box()
    path = tmp_path / 'thing.dae'
    path.write_text(DAE.format(
        asset=asset, count=3 * len(vertices), vertices=len(vertices), faces=len(mesh.faces),
        numbers=' '.join(map(str, np.ravel(vertices))),
        index=' '.join(map(str, mesh.faces.ravel()))))
    return path


def is_upright(mesh):
    """Return whether a mesh is the box with its narrow end up."""
    top = mesh.vertices[mesh.vertices[:, 2] > 0]
    return np.allclose(mesh.extents, SIZE, atol=1e-6) and np.isclose(np.ptp(top[:, 0]), 0.05)


@pytest.mark.parametrize('factor, scale, words', [
    (1000, None, ('millimetres', 'scale: 0.001')), (100, None, ('centimetres', 'scale: 0.01')),
    (39.37, None, ('inches', 'scale: 0.0254')), (1, 0.001, ('0.2 mm long', 'scale: 1')),
    (1000, 0.01, ('scale 0.01', 'scale: 0.001')), (100, 1e-6, ('scale: 0.01',)),
    (1e9, None, ('set scale',))])
def test_implausible_sizes_name_the_likely_unit(tmp_path, factor, scale, words):
    path = saved(tmp_path, box().apply_scale(factor))
    with pytest.raises(HoocError) as caught:
        load_mesh(path, scale)
    assert ';' in str(caught.value) and '\n' not in str(caught.value)
    for word in ('thing.ply', *words):
        assert word in str(caught.value)


@pytest.mark.parametrize('longest', [0.007, 0.015, 0.6, 1.1])
def test_unusual_but_possible_sizes_pass(tmp_path, longest):
    mesh = load_mesh(saved(tmp_path, box().apply_scale(longest / 0.2)))
    assert mesh.extents.max() == pytest.approx(longest, rel=1e-4)


def test_gltf_has_y_up_unless_the_set_says_otherwise(tmp_path):
    path = saved(tmp_path, box(), 'glb')            # trimesh writes coordinates as they are
    assert is_upright(load_mesh(path, up='z'))
    y_up = box()
    y_up.vertices = np.column_stack([y_up.vertices[:, 0], y_up.vertices[:, 2],
                                     -y_up.vertices[:, 1]])
    path = saved(tmp_path, y_up, 'glb')
    assert is_upright(load_mesh(path))
    assert not is_upright(load_mesh(path, up='z'))
    np.testing.assert_allclose(mesh_box(path)[1], SIZE, atol=1e-6)


@pytest.mark.parametrize('asset, of, unit', [
    ('<up_axis>Z_UP</up_axis>', lambda x, y, z: (x, y, z), 1.0),
    ('<unit name="inch" meter="0.0254"/><up_axis>Y_UP</up_axis>',
     lambda x, y, z: (x, z, -y), 0.0254),
    ('', lambda x, y, z: (x, z, -y), 1.0),
    ('<unit meter="0.01" name="cm"/>\n<up_axis> X_UP </up_axis>',
     lambda x, y, z: (z, -x, -y), 0.01)])
def test_collada_states_its_unit_and_up_axis(tmp_path, asset, of, unit):
    vertices = np.column_stack(of(*box().vertices.T)) / unit
    path = collada(tmp_path, vertices, asset)
    mesh = load_mesh(path)
    assert is_upright(mesh) and mesh.volume > 0, 'turned, not mirrored'
    np.testing.assert_allclose(load_mesh(path, scale=2 * unit).extents, 2 * np.array(SIZE))


def test_collada_with_entities_or_without_its_reader(tmp_path, monkeypatch):
    path = collada(tmp_path, box().vertices, '')
    path.write_text(path.read_text().replace('<COLLADA', '<!DOCTYPE a [<!ENTITY b "c">]><COLLADA'))
    with pytest.raises(HoocError, match='entities'):
        load_mesh(path)
    monkeypatch.setattr(mesh_file, '_installed', lambda module: False)
    with pytest.raises(HoocError, match='pip install pycollada'):
        load_mesh(path)


def test_bytes_behind_a_binary_stl_are_left_out(tmp_path):
    path = saved(tmp_path, box(), 'stl')
    whole = load_mesh(path)
    path.write_bytes(path.read_bytes() + b'\r\nmade by a modelling tool')
    np.testing.assert_array_equal(load_mesh(path).vertices, whole.vertices)
    path.write_text(trimesh.exchange.stl.export_stl_ascii(box()))
    assert is_upright(load_mesh(path)), 'text is no binary STL with a remainder'


def gltf(path, **changes):
    """Write a glTF file that can be read but for the changes."""
    content = {'asset': {'version': '2.0'}, 'nodes': [], 'accessors': [], **changes}
    path.write_text(json.dumps(content))
    return path


@pytest.mark.parametrize('changes, words', [
    ({'extensionsRequired': ['KHR_draco_mesh_compression']}, ('Draco', 'pip install DracoPy')),
    ({'extensionsRequired': ['EXT_meshopt_compression']}, ('meshopt', 'without compression')),
    ({'buffers': [{'uri': 'cup.bin'}]}, ('cup.bin', 'one file'))])
def test_gltf_that_cannot_be_read_names_the_cause(tmp_path, monkeypatch, changes, words):
    monkeypatch.setattr(mesh_file, '_installed', lambda module: False)
    with pytest.raises(HoocError) as caught:
        load_mesh(gltf(tmp_path / 'cup.gltf', **changes))
    for word in words:
        assert word in str(caught.value)
    assert 'thickness' not in str(caught.value)


def test_draco_is_read_where_its_reader_is_installed(tmp_path):
    DracoPy = pytest.importorskip('DracoPy')
    mesh = box()
    packed = DracoPy.encode(mesh.vertices.astype(np.float64), mesh.faces.astype(np.uint32))
    content = json.dumps({
        'asset': {'version': '2.0'}, 'scene': 0, 'scenes': [{'nodes': [0]}],
        'extensionsUsed': ['KHR_draco_mesh_compression'],
        'extensionsRequired': ['KHR_draco_mesh_compression'], 'nodes': [{'mesh': 0}],
        'meshes': [{'primitives': [{
            'attributes': {'POSITION': 1}, 'indices': 0, 'mode': 4,
            'extensions': {'KHR_draco_mesh_compression': {
                'bufferView': 0, 'attributes': {'POSITION': 0}}}}]}],
        'accessors': [{'componentType': 5125, 'count': mesh.faces.size, 'type': 'SCALAR'},
                      {'componentType': 5126, 'count': len(mesh.vertices), 'type': 'VEC3'}],
        'bufferViews': [{'buffer': 0, 'byteOffset': 0, 'byteLength': len(packed)}],
        'buffers': [{'byteLength': len(packed)}]}).encode()
    content += b' ' * (-len(content) % 4)
    packed += b'\0' * (-len(packed) % 4)
    chunks = (struct.pack('<I4s', len(content), b'JSON') + content
              + struct.pack('<I4s', len(packed), b'BIN\0') + packed)
    path = tmp_path / 'cup.glb'
    path.write_bytes(struct.pack('<4sII', b'glTF', 2, 12 + len(chunks)) + chunks)
    np.testing.assert_allclose(load_mesh(path, up='z').extents, SIZE, atol=1e-3)


def test_a_cloud_of_points_is_no_mesh(tmp_path):
    path = tmp_path / 'cup.ply'
    trimesh.PointCloud(np.random.default_rng(0).random((50, 3))).export(path)
    with pytest.raises(HoocError, match='cloud of 50 points'):
        load_mesh(path)


def test_a_stray_part_is_warned_of(tmp_path):
    mesh = box() + trimesh.creation.box((0.005,) * 3).apply_translation((0.9, 0, 0))
    with pytest.warns(HoocWarning, match='stray part of 12 faces .* 0.2 m; remove'):
        assert len(load_mesh(saved(tmp_path, mesh)).faces) == 24
    mesh = box() + trimesh.creation.box((0.005,) * 3).apply_translation((3, 0, 0))
    with pytest.raises(HoocError, match='stray part'):
        load_mesh(saved(tmp_path, mesh))


def test_parts_that_belong_together_are_no_strays(tmp_path):
    lid = box((0.1, 0.06, 0.01), (0, 0, 0.15))
    pair = box((0.02, 0.02, 0.2), (-0.3, 0, 0)) + box((0.02, 0.02, 0.2), (0.3, 0, 0))
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        load_mesh(saved(tmp_path, box() + lid))
        load_mesh(saved(tmp_path, pair))

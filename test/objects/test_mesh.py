# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Reading meshes: what comes out is clean and centred, and junk gets one sentence."""

import math
import struct

from hooc_perception.errors import HoocError
from hooc_perception.objects import mesh as mesh_module
from hooc_perception.objects import mesh_file
from hooc_perception.objects.mesh import load_mesh
import numpy as np
import pytest
import trimesh

BOX = trimesh.creation.box((0.1, 0.2, 0.3))


def _saved(tmp_path, mesh, kind):
    path = tmp_path / f'thing.{kind}'
    mesh.export(path)
    return path


@pytest.mark.parametrize('kind', ['ply', 'obj', 'stl', 'off', 'glb'])
def test_every_format_gives_the_same_centred_box(tmp_path, kind):
    moved = BOX.copy()
    moved.apply_translation((5.0, -3.0, 1.0))
    mesh = load_mesh(_saved(tmp_path, moved, kind))
    assert len(mesh.vertices) == 8 and len(mesh.faces) == 12 and mesh.is_watertight
    # Up is y in a glTF file.
    half = (0.05, 0.15, 0.1) if kind == 'glb' else (0.05, 0.1, 0.15)
    np.testing.assert_allclose(mesh.bounds, np.outer([-1, 1], half), atol=1e-6)


def test_scale_is_metres_per_unit(tmp_path):
    path = _saved(tmp_path, BOX.copy().apply_scale(1000.0), 'ply')
    np.testing.assert_allclose(load_mesh(path, 0.001).extents, (0.1, 0.2, 0.3), atol=1e-6)


def test_scene_of_several_meshes_becomes_one(tmp_path):
    other = BOX.copy()
    other.apply_translation((1.0, 0.0, 0.0))
    path = tmp_path / 'two.glb'
    trimesh.Scene([BOX, other]).export(path)
    mesh = load_mesh(path)
    assert len(mesh.faces) == 24
    np.testing.assert_allclose(mesh.extents, (1.1, 0.3, 0.2), atol=1e-6)


def test_materials_are_never_opened(tmp_path):
    path = _saved(tmp_path, BOX, 'obj')
    (tmp_path / 'secret.mtl').write_text('newmtl m\nmap_Kd ../../secret.png\n')
    path.write_text('mtllib secret.mtl\nmtllib ../../../../etc/passwd\nusemtl m\n'
                    + path.read_text())
    assert len(load_mesh(path).faces) == 12


def test_degenerate_and_doubled_faces_are_dropped(tmp_path):
    faces = np.vstack([BOX.faces, [[0, 0, 1]], BOX.faces[:1], BOX.faces[:1, ::-1]])
    path = _saved(tmp_path, trimesh.Trimesh(BOX.vertices, faces, process=False), 'ply')
    mesh = load_mesh(path)
    assert len(mesh.faces) == 12 and mesh.is_watertight


def test_missing_empty_and_unknown_files(tmp_path):
    with pytest.raises(HoocError, match='no.ply does not exist'):
        load_mesh(tmp_path / 'no.ply')
    for name, words in (('a.ply', 'empty file'), ('a.zip', 'empty file')):
        (tmp_path / name).touch()
        with pytest.raises(HoocError, match=words):
            load_mesh(tmp_path / name)
    for name in ('b.zip', 'b.docx', 'b'):
        (tmp_path / name).write_bytes(b'PK junk')
        with pytest.raises(HoocError, match='unknown format'):
            load_mesh(tmp_path / name)


@pytest.mark.parametrize('name, content', [
    ('a.ply', b'this is no mesh'),
    ('a.obj', b'\x00\xff\x00 rubbish'),
    ('a.off', b'OFF\n3 1 0\n0 0 0\n'),
    ('a.stl', b'\x00' * 80 + struct.pack('<I', 4 * 10**9) + b'\x00' * 50),
    ('a.glb', b'glTF' + b'\x00' * 40),
    ('a.ply', b'ply\nformat binary_little_endian 1.0\nelement vertex 900000000000\n'
              b'property float x\nproperty float y\nproperty float z\nelement face 1\n'
              b'property list uchar int vertex_indices\nend_header\n1234'),
    ('a.ply', b'ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n'
              b'property float z\nend_header\n0 0 0\n1 0 0\n0 1 1\n'),
    ('a.obj', b'v 0 0 0\nv 1 0 0\nv 0 1 1\nf 1 2 9\n')])
def test_junk_is_refused_in_one_sentence(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(HoocError, match=name) as caught:
        load_mesh(tmp_path / name)
    assert '\n' not in str(caught.value) and len(str(caught.value)) < 400


@pytest.mark.parametrize('value', [math.nan, math.inf])
def test_vertices_must_be_finite(tmp_path, value):
    vertices = BOX.vertices.copy()
    vertices[3, 1] = value
    path = _saved(tmp_path, trimesh.Trimesh(vertices, BOX.faces, process=False), 'ply')
    with pytest.raises(HoocError, match='not finite'):
        load_mesh(path)


@pytest.mark.parametrize('scale', [0.0, -1.0, math.nan, math.inf, '2', True])
def test_scale_must_be_positive(tmp_path, scale):
    with pytest.raises(HoocError, match='scale'):
        load_mesh(_saved(tmp_path, BOX, 'ply'), scale)


def test_sizes_that_cannot_be_meant(tmp_path):
    flat = trimesh.Trimesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
    with pytest.raises(HoocError, match='no extent'):
        load_mesh(_saved(tmp_path, flat, 'ply'))
    with pytest.raises(HoocError, match='millimetres'):
        load_mesh(_saved(tmp_path, BOX.copy().apply_scale(1000.0), 'ply'))


def test_limits_on_faces_and_bytes(tmp_path, monkeypatch):
    path = _saved(tmp_path, BOX, 'ply')
    monkeypatch.setattr(mesh_module, 'MAX_FACES', 11)
    with pytest.raises(HoocError, match='12 faces'):
        load_mesh(path)
    monkeypatch.setattr(mesh_file, 'MAX_BYTES', 100)
    with pytest.raises(HoocError, match='MB'):
        load_mesh(path)

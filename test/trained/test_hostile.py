# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Malicious files: rejected in one sentence, nothing executed, memory bounded."""

import copy
import json
from pathlib import Path
import pickle
import shutil
import struct
import subprocess
import sys
import zipfile

from hooc_perception.errors import HoocError
from hooc_perception.objects.derive import derive
from hooc_perception.objects.mesh import load_mesh
from hooc_perception.trained.folder import load_model_folder, save_model_folder
import numpy as np
import pytest
import trimesh

TRIANGLE = struct.pack('<9f', 0, 0, 0, .1, 0, 0, 0, .1, .05) + struct.pack('<3I', 0, 1, 2)
GLTF = {'asset': {'version': '2.0'}, 'scene': 0, 'scenes': [{'nodes': [0]}],
        'nodes': [{'mesh': 0}],
        'meshes': [{'primitives': [{'attributes': {'POSITION': 0}, 'indices': 1}]}],
        'accessors': [{'bufferView': 0, 'componentType': 5126, 'count': 3, 'type': 'VEC3'},
                      {'bufferView': 1, 'componentType': 5125, 'count': 3, 'type': 'SCALAR'}],
        'bufferViews': [{'buffer': 0, 'byteOffset': 0, 'byteLength': 36},
                        {'buffer': 0, 'byteOffset': 36, 'byteLength': 12}],
        'buffers': [{'byteLength': 48}]}
# Most that reading any of these may add to a process.
BOUND_MB = 400
READER = """
import resource, sys
from hooc_perception.errors import HoocError
from hooc_perception.trained.folder import load_model_folder
from hooc_perception.objects.mesh import load_mesh
reader = load_mesh if sys.argv[1] == 'mesh' else load_model_folder
resource.setrlimit(resource.RLIMIT_CPU, (120, 120))
for path in sys.argv[2:]:
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    try:
        reader(path)
        text = 'read'
    except HoocError as error:
        text = 'rejected ' + str(error).replace(chr(10), '<newline>')
    grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) // 1024
    print(path, grown, text, sep='|', flush=True)
"""


def read_apart(kind, paths):
    """Return {name: (MB that the process grew by, what came of it)}; one process reads all."""
    done = subprocess.run([sys.executable, '-c', READER, kind, *map(str, paths)],
                          capture_output=True, text=True, timeout=300)
    rows = [line.split('|', 2) for line in done.stdout.splitlines() if line.count('|') >= 2]
    assert len(rows) == len(paths), (len(rows), done.returncode, done.stderr[-500:])
    return {Path(path).name: (int(grown), text) for path, grown, text in rows}


def glb(content, binary=TRIANGLE):
    """Return the bytes of a GLB file."""
    text = json.dumps(content).encode()
    text += b' ' * (-len(text) % 4)
    return (struct.pack('<4sII', b'glTF', 2, 28 + len(text) + len(binary))
            + struct.pack('<I4s', len(text), b'JSON') + text
            + struct.pack('<I4s', len(binary), b'BIN\0') + binary)


def changed(**parts):
    return {**copy.deepcopy(GLTF), **parts}


def hostile_meshes():
    """Return {file name: bytes}."""
    files = {}
    for form in ('binary_little_endian', 'binary_big_endian', 'ascii'):
        head = f'ply\nformat {form} 1.0\nelement vertex %s\nproperty float x\nproperty float y\n'\
            'property float z\nelement face %s\nproperty list %s int vertex_indices\nend_header\n'
        files[f'many_{form}.ply'] = (head % (4 * 10**9, 4 * 10**9, 'uchar')).encode() + bytes(1000)
        files[f'list_{form}.ply'] = (head % (3, 1, 'uint')).encode() + bytes(36) + struct.pack(
            '<I', 2 ** 32 - 16) + bytes(100)
        files[f'negative_{form}.ply'] = (head % (-5, -1, 'uchar')).encode() + bytes(100)
    files['digits.ply'] = b'ply\nformat ascii 1.0\nelement vertex ' + b'9' * 10**5 + b'\n'
    files['count.stl'] = bytes(80) + struct.pack('<I', 2 ** 32 - 1) + bytes(500)
    files['many.off'] = b'OFF\n999999999 999999999 0\n0 0 0\n'
    points = b'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 '
    files['index.obj'], files['negative.obj'] = points + b'9' * 15, points + b'-999999999'
    accessors = copy.deepcopy(GLTF['accessors'])
    accessors[0]['count'] = 2 ** 31
    files['count.glb'] = glb(changed(accessors=accessors))
    empty = copy.deepcopy(accessors)
    del empty[0]['bufferView']
    files['zeros.glb'] = glb(changed(accessors=empty))
    files['tree.glb'] = glb(changed(nodes=[{'children': [2 * i + 1, 2 * i + 2]}
                                           for i in range(2 ** 14)] + [{'mesh': 0}] * 2 ** 14))
    vertices = np.random.default_rng(0).random((300, 3)).astype('<f4')
    faces = np.random.default_rng(0).integers(0, 300, (20000, 3)).astype('<u4')
    placed = changed(
        nodes=[{'children': list(range(1, 5001))}] + [{'mesh': 0}] * 5000,
        buffers=[{'byteLength': 243600}],
        bufferViews=[{'buffer': 0, 'byteOffset': 0, 'byteLength': 3600},
                     {'buffer': 0, 'byteOffset': 3600, 'byteLength': 240000}])
    placed['accessors'][0]['count'], placed['accessors'][1]['count'] = 300, 60000
    files['instances.glb'] = glb(placed, vertices.tobytes() + faces.tobytes())
    files['length.glb'] = struct.pack('<4sII', b'glTF', 2, 2 ** 32 - 1) + struct.pack(
        '<I4s', 2 ** 32 - 16, b'JSON') + b'{}'
    for name, uri in (('absolute', 'file:///etc/passwd'), ('upwards', '../../../etc/passwd')):
        files[f'{name}.gltf'] = json.dumps(changed(
            buffers=[{'byteLength': 48, 'uri': uri}])).encode()
    files['deep.gltf'] = b'{"a":' * 10**5
    bomb = zipfile.ZipInfo('a.ply')
    files['bomb.zip'] = (bomb, 2 ** 28)
    return files


def test_malicious_meshes_are_rejected_at_little_cost(tmp_path):
    files = hostile_meshes()
    for name, content in files.items():
        if isinstance(content, tuple):
            with zipfile.ZipFile(tmp_path / name, 'w', zipfile.ZIP_DEFLATED) as archive:
                archive.writestr(content[0], bytes(content[1]))
        else:
            (tmp_path / name).write_bytes(content)
    outcomes = read_apart('mesh', [tmp_path / name for name in files])
    assert {n: o for n, o in outcomes.items() if not o[1].startswith('rejected')} == {}
    assert {n: o for n, o in outcomes.items() if '<newline>' in o[1] or o[0] > BOUND_MB} == {}
    assert not any('root:' in text for _, text in outcomes.values())


def test_a_plain_glb_and_one_with_parts_are_still_read(tmp_path):
    (tmp_path / 'plain.glb').write_bytes(glb(GLTF))
    assert len(load_mesh(tmp_path / 'plain.glb').faces) == 1
    scene = trimesh.Scene()
    scene.add_geometry(trimesh.creation.box((0.1, 0.1, 0.1)))
    scene.add_geometry(trimesh.creation.box((0.1, 0.1, 0.1)),
                       transform=trimesh.transformations.translation_matrix([0.3, 0, 0]))
    scene.export(tmp_path / 'parts.glb')
    mesh = load_mesh(tmp_path / 'parts.glb')
    assert len(mesh.faces) == 24 and mesh.extents == pytest.approx([0.4, 0.1, 0.1])


@pytest.fixture(scope='module')
def good(tmp_path_factory):
    """Return the path of a small MODEL folder."""
    rng = np.random.default_rng(0)
    models = [derive('box', trimesh.creation.box((0.1, 0.06, 0.08)), rng, 50, 50)]
    classifier = {'kind': np.array(1), 'rows': np.arange(12.0)}
    return save_model_folder(tmp_path_factory.mktemp('m') / 'good', 'm', models, classifier,
                             'fast', 0, ()).path


def signed(folder):
    """Write the sizes and checksums of all files into model.json, as an attacker would."""
    import hashlib
    meta = json.loads((folder / 'model.json').read_text())
    for name in meta['files']:
        data = (folder / name).read_bytes()
        meta['files'][name] = {'bytes': len(data), 'sha256': hashlib.sha256(data).hexdigest()}
    (folder / 'model.json').write_text(json.dumps(meta))


class Bomb:
    """Runs when it is unpickled."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return Path.touch, (self.path,)


def npy(header, data=b'', version=1):
    """Return the bytes of an .npy file with any header."""
    form, limit = ('<H', 2 ** 16 - 1) if version == 1 else ('<I', 2 ** 32 - 1)
    size = header if isinstance(header, int) else len(header)
    return b'\x93NUMPY' + bytes([version, 0]) + struct.pack(form, min(size, limit)) + (
        b'' if isinstance(header, int) else header) + data


HUGE = b"{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000000,)}\n"
OBJECTS = b"{'descr': '|O', 'fortran_order': False, 'shape': (1,)}\n"


def hostile_folders(good, tmp_path):
    """Yield the paths of MODEL folders, each with correct checksums."""
    def variant(name):
        shutil.copytree(good, tmp_path / name)
        return tmp_path / name

    pickled = pickle.dumps(Bomb(tmp_path / 'executed'))
    for name, content in {
            'gigabyte_header': npy(2 ** 31, version=2), 'huge_shape': npy(HUGE, bytes(80)),
            'pickle': npy(OBJECTS, pickled), 'bare_pickle': pickled,
            'code': npy(b"__import__('pathlib').Path('executed').touch()\n"),
            'deep_header': npy(b'(' * 9000 + b'\n')}.items():
        folder = variant(f'array_{name}')
        (folder / 'classifier' / 'rows.npy').write_bytes(content)
        signed(folder)
        yield folder
        folder = variant(f'inside_{name}')
        with zipfile.ZipFile(folder / 'models.npz') as archive:
            entries = {info.filename: archive.read(info) for info in archive.infolist()}
        entries['vertices.npy'] = content
        with zipfile.ZipFile(folder / 'models.npz', 'w') as archive:
            for entry, data in entries.items():
                archive.writestr(entry, data)
        signed(folder)
        yield folder
    folder = variant('zip_bomb')
    with zipfile.ZipFile(folder / 'models.npz', 'w', zipfile.ZIP_DEFLATED) as archive:
        header = b"{'descr': '|u1', 'fortran_order': False, 'shape': (%d,)}\n" % 2 ** 29
        archive.writestr('vertices.npy', npy(header, bytes(2 ** 29)))
    signed(folder)
    yield folder
    for name, camera in {'wide': {'width': 10 ** 9}, 'zero': {'height': 0},
                         'flat': {'K': [0, 0, 1, 0, 0, 1, 0, 0, 1]}}.items():
        folder = variant(f'camera_{name}')
        meta = json.loads((folder / 'model.json').read_text())
        meta['cameras'] = [{'name': 'a', 'width': 64, 'height': 48,
                            'distortion_model': 'plumb_bob', 'K': [60, 0, 32, 0, 60, 24, 0, 0, 1],
                            'D': [], 'T_world_camera': np.eye(4).ravel().tolist(), **camera}]
        (folder / 'model.json').write_text(json.dumps(meta))
        yield folder
    for name, text in {'deep': '[' * 10 ** 5, 'digits': '{"seed": ' + '9' * 10 ** 5 + '}'}.items():
        folder = variant(f'json_{name}')
        (folder / 'model.json').write_text(text)
        yield folder


def test_malicious_model_folders_are_rejected_at_little_cost(good, tmp_path):
    folders = list(hostile_folders(good, tmp_path))
    outcomes = read_apart('folder', folders)
    assert {n: o for n, o in outcomes.items() if not o[1].startswith('rejected')} == {}
    assert {n: o for n, o in outcomes.items() if '<newline>' in o[1] or o[0] > BOUND_MB} == {}
    assert not (tmp_path / 'executed').exists() and not Path('executed').exists()
    assert load_model_folder(good).name == 'm'


def test_a_pipe_in_place_of_a_file_does_not_hang(good, tmp_path):
    import os
    folder = tmp_path / 'pipe'
    shutil.copytree(good, folder)
    (folder / 'classifier' / 'rows.npy').unlink()
    os.mkfifo(folder / 'classifier' / 'rows.npy')
    with pytest.raises(HoocError, match='missing'):
        load_model_folder(folder)
    os.mkfifo(tmp_path / 'mesh.ply')
    with pytest.raises(HoocError, match='does not exist'):
        load_mesh(tmp_path / 'mesh.ply')

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
The C++ client, compiled against the real message headers and run on bytes that the node sends.

rclcpp is not on PyPI: a stub hands the messages over and checks topics and QoS.
"""

from pathlib import Path
import shutil
import subprocess
import sys

import numpy as np
import pytest

pytest.importorskip('rclpy')


def test_cpp_client_reads_what_the_parsing_node_writes(repository, tmp_path):
    include = Path(sys.prefix) / 'include'
    if not shutil.which('g++'):
        pytest.skip('no g++')
    if not (include / 'sensor_msgs').is_dir():
        pytest.skip('no message headers in this environment')
    from hooc_perception.core.types import Candidates, Energy, ParsedScene
    from hooc_perception.objects.derive import derive
    from hooc_perception.ros.messages import conversions as c
    from hooc_perception.ros.messages.stages import labels_json, objects_messages
    import trimesh
    rng = np.random.default_rng(0)
    models = [derive(name, trimesh.creation.box(), rng, 50, 50) for name in ('tea cup', 'drill')]
    objects = Candidates(np.array([2, 1], np.uint16), np.array([[0.1, -0.2, 0.3], [0, 1, 2.0]]),
                         np.tile([0, 0, 0, 1.0], (2, 1)), np.ones((2, 3), np.float32),
                         np.array([0.75, 0.5], np.float32))
    some = np.ones(2, np.float32)
    parsed = ParsedScene(objects, Energy(0, 0, 0), some, some, some, np.ones(2, np.uint8), objects)
    cloud = objects_messages(parsed, [7, 90000], 0.1, c.header(5, 'table'))[1]
    files = {name: tmp_path / name for name in ('LABELS', 'HEAD', 'DATA')}
    files['LABELS'].write_text(labels_json(models, [[('file:///x', 'ab')]] * 2, [7, 90000],
                                           objects))
    files['HEAD'].write_text(f'table {cloud.width} {cloud.point_step}\n' + ''.join(
        f'{f.name} {f.offset} {f.datatype}\n' for f in cloud.fields))
    files['DATA'].write_bytes(bytes(cloud.data))
    program = tmp_path / 'list_objects'
    includes = [flag for path in include.iterdir() for flag in ('-I', path)]
    built = subprocess.run(
        ['g++', '-std=c++17', '-Wall', '-Wextra', '-Wno-unused-parameter', '-o', program,
         repository / 'examples' / 'list_objects.cpp', *includes,
         '-idirafter', Path(__file__).with_name('stubs')],
        capture_output=True, text=True, timeout=300)
    assert built.returncode == 0, built.stderr[-3000:]
    assert 'list_objects.cpp' not in built.stderr, built.stderr
    run = subprocess.run([program], env={k: str(v) for k, v in files.items()},
                         capture_output=True, text=True, timeout=30)
    assert run.returncode == 0
    assert run.stdout.splitlines() == [
        '7 drill 0.75 at 0.100 -0.200 0.300 in table',
        '90000 tea cup 0.50 at 0.000 1.000 2.000 in table']

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Who may import whom: the layers of the package, read off the syntax trees."""

import ast
from pathlib import Path
import sys

import pytest

PACKAGE = Path(__file__).resolve().parent.parent / 'hooc_perception'

# What a layer may use beside the standard library, `errors`, `chain` and itself; 'a.b' admits only
# that module, 'a/b' is a folder with a rule of its own. The command line (cli) may use anything.
ALLOWED = {
    'core': {'numpy', 'scipy', 'numba'},
    'objects': {'numpy', 'scipy', 'numba', 'trimesh', 'manifold3d', 'networkx', 'yaml', 'PIL',
                'pyrender', 'OpenGL', 'hooc_perception.core'},
    'trained': {'numpy', 'trimesh', 'hooc_perception.core'},
    'io': {'numpy', 'cv2', 'hooc_perception.core'},
    'io/scenes': {'numpy', 'scipy', 'yaml', 'cv2', 'trimesh', 'hooc_perception.core',
                  'hooc_perception.objects.mesh', 'hooc_perception.io.depth_encodings',
                  'hooc_perception.io.depth_units'},
    'io/bags': {'numpy', 'scipy', 'yaml', 'cv2', 'rosbags', 'mcap', 'lz4', 'zstandard',
                'hooc_perception.core', 'hooc_perception.io.scenes',
                'hooc_perception.io.camera_info', 'hooc_perception.io.compressed_depth',
                'hooc_perception.io.depth_encodings', 'hooc_perception.io.depth_units'},
    'robot': {'numpy', 'trimesh', 'yourdfpy', 'lxml', 'hooc_perception.core',
              'hooc_perception.io.scenes.png'},
    'synthesis': {'numpy', 'scipy', 'numba', 'yaml', 'cv2', 'fcl', 'mujoco', 'trimesh',
                  'manifold3d', 'open3d', 'joblib', 'tqdm',
                  'hooc_perception.core', 'hooc_perception.objects', 'hooc_perception.io.scenes'},
    'training': {'numpy', 'scipy', 'numba', 'sklearn', 'joblib', 'tqdm', 'hooc_perception.core',
                 'hooc_perception.parser',
                 'hooc_perception.objects', 'hooc_perception.synthesis',
                 'hooc_perception.trained'},
    'training/network': {'numpy', 'joblib', 'tqdm', 'torch', 'hooc_perception.core',
                         'hooc_perception.objects', 'hooc_perception.synthesis',
                         'hooc_perception.training', 'hooc_perception.io.scenes.scene_set'},
    'evaluation': {'numpy', 'scipy', 'yaml', 'cv2', 'PIL', 'sklearn', 'matplotlib', 'jinja2',
                   'markupsafe', 'pyrender', 'OpenGL', 'trimesh', 'open3d', 'tqdm', 'rerun',
                   'hooc_perception.core', 'hooc_perception.objects', 'hooc_perception.trained',
                   'hooc_perception.io.scenes', 'hooc_perception.parser'},
    'ros': {'numpy', 'scipy', 'rclpy', 'hooc_perception.core',
            'hooc_perception.io.camera_info', 'hooc_perception.io.compressed_depth',
            'hooc_perception.io.depth_encodings', 'hooc_perception.io.depth_units',
            'hooc_perception.io.frame_sets'},
    'nodes': {'numpy', 'rclpy', 'hooc_perception.core', 'hooc_perception.ros',
              'hooc_perception.io.frame_sets', 'hooc_perception.trained',
              'hooc_perception.robot', 'hooc_perception.parser', 'hooc_perception.extras',
              'trimesh'},
    'benchmark': {'numpy', 'scipy', 'cv2', 'open3d', 'sklearn', 'manifold3d', 'trimesh',
                  'rclpy', 'psutil', 'matplotlib', 'hooc_perception.core',
                  'hooc_perception.io', 'hooc_perception.diagnosis', 'hooc_perception.ros',
                  'hooc_perception.supervisor', 'hooc_perception.objects',
                  'hooc_perception.trained', 'hooc_perception.synthesis',
                  'hooc_perception.parser'},
    'experiments': {'numpy', 'hooc_perception.evaluation', 'hooc_perception.io.scenes'},
    'calibration': {'numpy', 'scipy', 'matplotlib', 'hooc_perception.core', 'hooc_perception.io'},
    'diagnosis': {'numpy', 'hooc_perception.core', 'hooc_perception.io', 'hooc_perception.extras',
                  'hooc_perception.objects', 'hooc_perception.trained'},
    'supervisor': {'numpy', 'yaml', 'rclpy', 'psutil', 'tqdm', 'hooc_perception.core',
                   'hooc_perception.ros', 'hooc_perception.nodes',
                   'hooc_perception.trained', 'hooc_perception.io'},
}
# Message packages; tf2 and launch exist only on a ROS installation and stand behind guards.
MESSAGES = {'action_msgs', 'builtin_interfaces', 'diagnostic_msgs', 'geometry_msgs',
            'lifecycle_msgs', 'rcl_interfaces', 'sensor_msgs', 'std_msgs', 'std_srvs', 'tf2_msgs',
            'tf2_ros', 'visualization_msgs', 'ament_index_python', 'shape_msgs'}
for ros_layer in ('ros', 'nodes', 'supervisor', 'benchmark'):
    ALLOWED[ros_layer] |= MESSAGES
EXCEPTIONS = {
    ('core/classification/table_network.py', 'cv2'),
    ('nodes/replay_node.py', 'hooc_perception.io.bags'),
}


def imported_modules(path):
    """Yield (line, dotted module) of every import in a file, those inside functions too."""
    for node in ast.walk(ast.parse(path.read_text(), str(path))):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield node.lineno, alias.name
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f'{path}:{node.lineno}: relative import'
            if node.module.startswith('hooc_perception'):
                # `from hooc_perception.objects import folder` names models.folder.
                for alias in node.names:
                    yield node.lineno, f'{node.module}.{alias.name}'
            else:
                yield node.lineno, node.module


def permitted(module, layer, relative):
    """Say whether `layer` may import `module` in the file `relative` (posix path)."""
    if module.split('.')[0] in sys.stdlib_module_names:
        return True
    allowed = ALLOWED[layer] | {f'hooc_perception.{layer.replace("/", ".")}',
                                'hooc_perception.errors', 'hooc_perception.chain'}
    allowed |= {name for file, name in EXCEPTIONS if file == relative}
    return any(module == name or module.startswith(name + '.') for name in allowed)


def layer_of(relative):
    """Return the key of ALLOWED that holds for a file: of its folder, else of the outermost."""
    parts = relative.split('/')
    inner = '/'.join(parts[:2])
    return inner if inner in ALLOWED else parts[0]


def violations(path, package=PACKAGE):
    """Return one sentence for each import of `path` that its layer does not permit."""
    relative = path.relative_to(package).as_posix()
    layer = layer_of(relative)
    return [f'{relative}:{line}: {layer} must not import {module}'
            for line, module in imported_modules(path) if not permitted(module, layer, relative)]


@pytest.mark.parametrize('layer', sorted(ALLOWED))
def test_layer_imports_only_what_lies_below(layer):
    found = [text for path in sorted((PACKAGE / layer).rglob('*.py')) for text in violations(path)
             if layer_of(path.relative_to(PACKAGE).as_posix()) == layer]
    assert not found, '\n'.join(found)


# The rooms of core from the lowest floor up; each may import from those before it.
CORE = ('kernel_cache', 'arrays', 'config', 'types', 'kernels', 'geometry', 'symmetry', 'memo',
        'shapes', 'render', 'segment', 'incremental', 'frame', 'extrinsics', 'classification',
        'energy', 'hypotheses', 'parsing', 'methods', 'profiles')


def rooms_above(path, package=PACKAGE):
    """Return one sentence for each import of a core module that leads to a higher room."""
    relative = path.relative_to(package / 'core')
    room = relative.parts[0].removesuffix('.py')
    allowed = CORE[:CORE.index(room) + 1]
    return [f'core/{relative.as_posix()}:{line}: {room} must not import {module}'
            for line, module in imported_modules(path)
            if module.startswith('hooc_perception.core.') and module.split('.')[2] not in allowed]


def test_core_imports_run_downwards():
    files = [path for path in (PACKAGE / 'core').rglob('*.py') if path.parent.name != 'core'
             or path.name != '__init__.py']
    assert len(files) > 50
    found = [text for path in files for text in rooms_above(path)]
    assert not found, '\n'.join(found)


def test_an_upward_import_is_noticed(tmp_path):
    path = tmp_path / 'core' / 'frame' / 'bad.py'
    path.parent.mkdir(parents=True)
    path.write_text('from hooc_perception.core.parsing.search import Search\n'
                    'from hooc_perception.core.types import Camera\n')
    assert len(rooms_above(path, tmp_path)) == 1


def test_every_folder_has_a_rule():
    folders = {path.parent.relative_to(PACKAGE).parts[0] for path in PACKAGE.glob('*/**/*.py')}
    folders |= {path.parent.name for path in PACKAGE.glob('*/*.py')}
    assert folders - {'cli'} <= set(ALLOWED), 'a new layer needs a row in ALLOWED'


def test_top_level_modules_import_nothing_heavy():
    for name in ('errors.py', 'core/kernel_cache.py'):
        for line, module in imported_modules(PACKAGE / name):
            assert module.split('.')[0] in sys.stdlib_module_names, f'{name}:{line}: {module}'


@pytest.mark.parametrize('source', [
    'import rclpy', 'from hooc_perception.objects.mesh import load_mesh',
    'from hooc_perception import models', 'def f():\n    import trimesh.util'])
def test_the_rule_notices(tmp_path, source):
    path = tmp_path / 'core' / 'bad.py'
    path.parent.mkdir()
    path.write_text(source)
    assert len(violations(path, tmp_path)) == 1


def test_the_rule_lets_through(tmp_path):
    path = tmp_path / 'core' / 'good.py'
    path.parent.mkdir()
    path.write_text('import os\nimport numba as nb\nfrom scipy.spatial import cKDTree\n'
                    'from hooc_perception.errors import HoocError\n'
                    'from hooc_perception.core import types\n')
    assert violations(path, tmp_path) == []

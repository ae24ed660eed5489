# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""package.xml and requirements-ros.txt name what the package needs next to a ROS installation."""

import ast
from pathlib import Path
import subprocess
import sys
import tomllib
from xml.etree import ElementTree

from packaging.requirements import Requirement
import pytest

ROOT = Path(__file__).resolve().parent.parent
PROJECT = tomllib.loads((ROOT / 'pyproject.toml').read_text())['project']

# Module -> its rosdep key, where that is not the name of the module (a ROS package).
KEYS = {
    'numpy': 'python3-numpy', 'scipy': 'python3-scipy', 'numba': 'python3-numba',
    'yaml': 'python3-yaml', 'cv2': 'python3-opencv', 'networkx': 'python3-networkx',
    'joblib': 'python3-joblib', 'jinja2': 'python3-jinja2', 'markupsafe': 'python3-jinja2',
    'matplotlib': 'python3-matplotlib', 'PIL': 'python3-pil', 'sklearn': 'python3-sklearn',
    'tqdm': 'python3-tqdm', 'psutil': 'python3-psutil', 'lxml': 'python3-lxml',
    'collada': 'python3-collada', 'trimesh': 'python3-trimesh-pip',
    'rosbags': 'python3-rosbags-pip', 'mujoco': 'python3-mujoco-pip',
    'open3d': 'python3-open3d-pip', 'fcl': 'python-fcl-pip', 'yourdfpy': 'python3-yourdfpy-pip',
}
WITHOUT_KEY = {'manifold3d', 'mcap', 'lz4', 'zstandard'}
# What a robot may do without: message packages that are asked for by parameters, viewers, Dask,
# training again what comes with the package.
OPTIONAL = {'vision_msgs', 'moveit_msgs', 'pyrender', 'rerun', 'distributed', 'torch'}
# Needed, but not by an import statement: networkx and collada by trimesh, tf2_msgs by name, the
# rest by the command `ros2 launch` and by Open3D.
NOT_IMPORTED = {'python3-networkx', 'python3-collada', 'tf2_msgs', 'ros2launch', 'libusb-1.0'}
# Of numpy 2, which Ubuntu 24.04 does not have.
NUMPY_2 = {'acos', 'acosh', 'asin', 'asinh', 'astype', 'atan', 'atan2', 'atanh', 'bitwise_count',
           'bitwise_invert', 'concat', 'cumulative_prod', 'cumulative_sum', 'isdtype', 'matmat',
           'matrix_norm', 'matrix_transpose', 'matvec', 'permute_dims', 'pow', 'svdvals',
           'trapezoid', 'unique_all', 'unique_counts', 'unique_inverse', 'unique_values',
           'unstack', 'vecdot', 'vecmat', 'vector_norm'}
APT_ONLY = {'opencv-contrib-python-headless'}      # apt's has no metadata that pip could see


def declared():
    """Return the keys that package.xml needs at run time."""
    manifest = ElementTree.parse(ROOT / 'package.xml').getroot()
    return [row.text for row in manifest if row.tag in ('depend', 'exec_depend')]


def imported():
    """Return the top-level modules that the package and its launch files import."""
    found = set()
    for path in [*(ROOT / 'hooc_perception').rglob('*.py'), *(ROOT / 'launch').glob('*.py')]:
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                found |= {alias.name.partition('.')[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                found.add(node.module.partition('.')[0])
    return found - set(sys.stdlib_module_names) - {'hooc_perception'}


def test_the_manifest_names_what_is_imported():
    wanted = {KEYS.get(module, module) for module in imported() - OPTIONAL - WITHOUT_KEY}
    assert len(declared()) == len(set(declared()))
    assert sorted(wanted - set(declared())) == []
    assert sorted(set(declared()) - wanted - NOT_IMPORTED) == []


def rows():
    """Return {name: Requirement} of requirements-ros.txt."""
    lines = (ROOT / 'requirements-ros.txt').read_text().splitlines()
    found = [Requirement(line) for line in lines if line and not line.startswith('#')]
    assert len({row.name for row in found}) == len(found)
    return {row.name.lower(): row for row in found}


def test_the_requirements_next_to_ros_are_those_of_the_project():
    extras = PROJECT['optional-dependencies']
    wanted = {row.name.lower(): row for row in map(Requirement, (
        *PROJECT['dependencies'], *extras['train'], *extras['eval'], *extras['robot']))}
    found = rows()
    assert set(found) == set(wanted) - APT_ONLY
    for name in set(found) - {'numpy'}:
        assert found[name].specifier == wanted[name].specifier, name


@pytest.mark.parametrize('name, version', [
    ('numpy', '1.26.4'), ('opencv-contrib-python-headless', '4.6.0'),
    ('networkx', '2.8.8'), ('matplotlib', '3.6.3'), ('joblib', '1.3.2'), ('pillow', '10.2.0'),
    ('scikit-learn', '1.4.1'), ('PyYAML', '6.0.1'), ('Jinja2', '3.1.2'), ('psutil', '5.9.8'),
    ('tqdm', '4.66.2')])
def test_the_packages_of_ubuntu_24_04_are_in_the_ranges(name, version):
    every = [*PROJECT['dependencies'], *PROJECT['optional-dependencies']['eval']]
    project, = (row for row in map(Requirement, every) if row.name == name)
    assert project.specifier.contains(version)
    if name not in APT_ONLY:
        assert rows()[name.lower()].specifier.contains(version)


def test_numpy_2_is_never_installed_next_to_ros():
    assert not rows()['numpy'].specifier.contains('2.0.0')


def newer_than_ubuntu(code):
    """Return what a source uses of numpy 2, and of scipy as it is since 1.15."""
    found = []
    for node in ast.walk(ast.parse(code)):
        if isinstance(node, ast.Attribute) and node.attr in NUMPY_2 and (
                ast.unparse(node.value) in ('np', 'np.linalg')):
            found.append(ast.unparse(node))
        if isinstance(node, ast.Call) and ast.unparse(node.func) == 'Rotation.random' and (
                node.keywords):
            found.append(ast.unparse(node))
    return found


def test_no_source_needs_more_than_ubuntu_24_04_has():
    assert sorted(newer_than_ubuntu(
        'np.bitwise_count(a); Rotation.random(rng=g); np.linalg.norm(b)')) == [
            'Rotation.random(rng=g)', 'np.bitwise_count']
    sources = [path for part in ('hooc_perception', 'test')
               for path in (ROOT / part).rglob('*.py')]
    assert len(sources) > 200
    assert {str(path.relative_to(ROOT)): found for path in sources
            if (found := newer_than_ubuntu(path.read_text()))} == {}


def test_launch_files_need_nothing_from_pypi():
    """`ros2 launch` runs in the Python of the system, which lacks what the environment has."""
    modules = set()
    for path in (ROOT / 'launch').glob('*.py'):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom) and node.module.startswith('hooc_perception'):
                modules.add(node.module)
                modules |= {f'{node.module}.{alias.name}' for alias in node.names if (
                    ROOT / node.module.replace('.', '/') / f'{alias.name}.py').is_file()}
    assert 'hooc_perception.chain' in modules
    code = ('import importlib, sys; before = set(sys.modules)\n'
            f'for name in {sorted(modules)}: importlib.import_module(name)\n'
            'print(*{name.partition(".")[0] for name in set(sys.modules) - before})')
    run = subprocess.run([sys.executable, '-c', code], cwd=ROOT, check=True, text=True,
                         capture_output=True)
    found = set(run.stdout.split())
    assert 'hooc_perception' in found
    assert sorted(found & ({*KEYS, *WITHOUT_KEY, *OPTIONAL} - {'yaml'})) == []

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What a user or a ROS installation sees of the package: manifests, entry points, launch."""

import ast
import importlib
from importlib.metadata import packages_distributions
from pathlib import Path
import runpy
import subprocess
import sys
import tomllib
from xml.etree import ElementTree

from hooc_perception.extras import advice, EXTRA_OF
from packaging.requirements import Requirement
import pytest
import yaml

ROOT = Path(__file__).resolve().parent.parent
NODES = ['ingestion_node', 'classification_node', 'candidate_node', 'parsing_node', 'replay_node']
PROJECT = tomllib.loads((ROOT / 'pyproject.toml').read_text())['project']
MANIFEST = ElementTree.parse(ROOT / 'package.xml').getroot()


def setup_of(field):
    """Return what setup.py says about `field`."""
    return subprocess.run([sys.executable, 'setup.py', '-q', f'--{field}'], cwd=ROOT, check=True,
                          capture_output=True, text=True).stdout.strip()


def test_manifest_is_format_3_and_valid():
    pytest.importorskip('catkin_pkg')
    from catkin_pkg.package import parse_package
    warnings = []
    package = parse_package(str(ROOT / 'package.xml'), warnings=warnings)
    package.validate(warnings)
    assert package.package_format == 3
    assert package.get_build_type() == 'ament_python'
    assert not warnings


def test_setup_and_manifest_agree():
    assert setup_of('name') == MANIFEST.findtext('name')
    assert setup_of('version') == MANIFEST.findtext('version')
    assert setup_of('license') == MANIFEST.findtext('license')


def test_changelog_has_the_package_name():
    assert 'Changelog for package hooc_perception' in (ROOT / 'CHANGELOG.rst').read_text()


@pytest.mark.parametrize('node', NODES)
def test_node_executables_import(node):
    pytest.importorskip('rclpy')
    assert callable(importlib.import_module(f'hooc_perception.nodes.{node}').main)


def test_project_declares_every_executable():
    assert PROJECT['scripts'] == {
        'hooc': 'hooc_perception.cli.main:main',
        **{node: f'hooc_perception.nodes.{node}:main' for node in NODES}}


def test_launch_files_compile():
    files = sorted((ROOT / 'launch').glob('*.launch.py'))
    assert {path.name for path in files} >= {'perception.launch.py', 'replay.launch.py'}
    for path in files:
        names = {}
        code = compile(path.read_text(), str(path), 'exec')
        assert 'generate_launch_description' in code.co_names
        try:
            exec(code, names)
        except ImportError as error:      # launch exists only on a ROS installation
            assert error.name.split('.')[0] in {'launch', 'launch_ros', 'ament_index_python'}
        else:
            names['generate_launch_description']()


def distributions(requirements):
    """Return the normalized names of the distributions that requirements name."""
    return {Requirement(row).name.lower().replace('_', '-') for row in requirements}


def imported():
    """Return the names of the top-level modules that the package imports anywhere."""
    found = set()
    for path in (ROOT / 'hooc_perception').rglob('*.py'):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                found |= {alias.name.partition('.')[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                found.add(node.module.partition('.')[0])
    return found - set(sys.stdlib_module_names) - {'hooc_perception'}


# Modules of a ROS installation that stand behind guards.
GUARDED = {'ament_index_python', 'tf2_ros', 'tf2_msgs', 'vision_msgs', 'moveit_msgs'}


def test_every_import_is_a_declared_dependency():
    providers = packages_distributions()
    missing = []
    for module in sorted(imported() - GUARDED):
        extra = EXTRA_OF.get(module)
        rows = PROJECT['optional-dependencies'][extra] if extra else PROJECT['dependencies']
        # The rebuilds of ROS come as one distribution per package, below those that we name.
        if extra != 'ros' and module in providers and not (
                distributions(rows) & {name.lower().replace('_', '-')
                                       for name in providers[module]}):
            missing.append((module, extra))
    assert not missing


def test_every_extra_is_declared():
    assert set(EXTRA_OF.values()) <= set(PROJECT['optional-dependencies'])
    assert {'ros', 'train', 'eval', 'view', 'dask'} <= set(PROJECT['optional-dependencies'])


def test_advice_names_the_extra():
    with pytest.raises(ModuleNotFoundError) as caught:
        importlib.import_module('mujoco.no_such_part')
    assert "pip install 'hooc_perception[train]'" in advice(caught.value)
    assert advice(ImportError('broken', name='mujoco')) is None
    assert advice(ModuleNotFoundError('gone', name='some_other_thing')) is None


def test_every_dependency_is_pinned():
    pins = [Requirement(line) for line in (ROOT / 'requirements.txt').read_text().splitlines()
            if line and not line.startswith('#')]
    versions = {pin.name.lower(): next(iter(pin.specifier)).version for pin in pins}
    wanted = runpy.run_path(str(ROOT / 'scripts/lock.py'))['wanted']()
    unmet = [row for row in map(Requirement, wanted)
             if not row.specifier.contains(versions.get(row.name.lower().replace('_', '-'), '0'))]
    assert not [str(row) for row in unmet]


@pytest.mark.parametrize('script', ['scripts/setup.sh', '.ci/run'])
def test_shell_scripts_parse(script):
    subprocess.run(['bash', '-n', str(ROOT / script)], check=True)


def test_citation_has_the_version_of_the_package():
    citation = yaml.safe_load((ROOT / 'CITATION.cff').read_text())
    assert citation['version'] == MANIFEST.findtext('version')
    assert citation['license'] == MANIFEST.findtext('license')
    assert [row['family-names'] for row in citation['references'][0]['authors']] == [
        'Basevi', 'Leonardis']


def test_the_workflow_runs_what_contributors_run():
    jobs = yaml.safe_load((ROOT / '.github/workflows/ci.yml').read_text())['jobs']
    run = {name: [step['run'] for step in job['steps'] if 'run' in step]
           for name, job in jobs.items()}
    assert run['ubuntu'] == ['make test'] and run['debian'][-1] == 'make test'
    assert jobs['ubuntu']['strategy']['matrix']['python'] == ['3.11', '3.12']
    assert run['docs'] == ['make docs']

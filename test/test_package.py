# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What a user or a ROS installation sees of the package: manifests, entry points, launch."""

import importlib
from pathlib import Path
import re
import subprocess
import sys
from xml.etree import ElementTree

import pytest

ROOT = Path(__file__).resolve().parent.parent
NODES = ['ingestion_node', 'classification_node', 'candidate_node', 'parsing_node', 'replay_node']
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


def test_setup_declares_every_executable():
    text = (ROOT / 'setup.py').read_text()
    assert 'hooc = hooc_perception.cli.main:main' in text
    assert re.search(r'NODES = \((.*?)\)', text, re.S)
    assert re.findall(r"'(\w+_node)'", text) == NODES


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


def test_every_import_of_the_package_is_pinned():
    pinned = {line.split('==')[0].lower() for line in
              (ROOT / 'requirements.txt').read_text().splitlines() if '==' in line}
    wanted = {re.split(r'[\[=<>]', line)[0].lower() for line in
              (ROOT / 'requirements.in').read_text().splitlines()
              if line and not line.startswith('#')}
    assert wanted <= pinned


@pytest.mark.parametrize('script', ['scripts/setup.sh', '.ci/run'])
def test_shell_scripts_parse(script):
    subprocess.run(['bash', '-n', str(ROOT / script)], check=True)

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Launch files, parameter files and documentation fit the nodes that they describe."""

from dataclasses import fields
import importlib
import re
import tomllib

from hooc_perception.chain import node_class
import pytest
import yaml

pytest.importorskip('rclpy')

NODES = ('ingestion_node', 'classification_node', 'candidate_node', 'parsing_node',
         'replay_node')


def own_config(name):
    """Return the Config class of a node's own parameters."""
    module = importlib.import_module(f'hooc_perception.nodes.{name}')
    return getattr(module, node_class(name)).CONFIG


@pytest.mark.parametrize('name', ['perception', 'replay'])
def test_launch_files_compile_and_name_what_exists(repository, name):
    text = (repository / 'launch' / f'{name}.launch.py').read_text()
    compile(text, f'{name}.launch.py', 'exec')
    assert 'def generate_launch_description() -> LaunchDescription:' in text
    named = set(re.findall(r"'(\w+_node)'", text))
    assert (named or 'import CHAIN' in text) and named <= set(NODES)
    for parameter in re.findall(r'^ +parameters=\[\{(.*?)\}\]', text, re.DOTALL | re.MULTILINE):
        names = set(re.findall(r"'(\w+)':", parameter))
        assert names <= {f.name for f in fields(own_config('replay_node'))}


def test_parameter_file_names_only_declared_parameters(repository):
    content = yaml.safe_load((repository / 'config' / 'perception.yaml').read_text())
    sections = {key.rpartition('/')[2]: values['ros__parameters'] or {}
                for key, values in content.items()}
    assert set(sections) == {'**', *NODES}
    for node in NODES:
        known = {f.name for f in fields(own_config(node))}
        assert set(sections[node]) <= known, node


def test_documented_parameters_have_not_drifted(repository):
    from hooc_perception.ros.lifecycle.document_parameters import documented
    text = (repository / 'docs' / 'nodes.md').read_text()
    assert text.count('<!-- parameters:') == 8
    assert documented(text) == text, (
        'run python -m hooc_perception.ros.lifecycle.document_parameters docs/nodes.md')


def test_every_topic_is_documented(repository):
    from hooc_perception.chain import TOPICS
    text = (repository / 'docs' / 'nodes.md').read_text()
    assert [topic for topic in TOPICS if f'`{topic}`' not in text] == []


def test_every_node_is_an_executable(repository):
    scripts = tomllib.loads((repository / 'pyproject.toml').read_text())['project']['scripts']
    for node in NODES:
        assert scripts[node] == f'hooc_perception.nodes.{node}:main'
        assert callable(importlib.import_module(f'hooc_perception.nodes.{node}').main)

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The declaration of the chain fits the code, and whatever cannot import it agrees with it."""

import ast
from pathlib import Path
import sys
import tomllib

from hooc_perception import chain
from hooc_perception.core.profiles import Profile, profile

ROOT = Path(__file__).resolve().parent.parent


def test_it_imports_nothing_that_launch_files_lack():
    for node in ast.walk(ast.parse((ROOT / 'hooc_perception' / 'chain.py').read_text())):
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else (
            [node.module] if isinstance(node, ast.ImportFrom) else [])
        for name in names:
            assert name.split('.')[0] in sys.stdlib_module_names or (
                name == 'hooc_perception.errors'), name


def test_every_node_has_a_module_and_an_executable():
    folder = ROOT / 'hooc_perception' / 'nodes'
    assert {path.stem for path in folder.glob('*_node.py')} == set(chain.NODES)
    scripts = tomllib.loads((ROOT / 'pyproject.toml').read_text())['project']['scripts']
    assert [name for name in scripts if name.endswith('_node')] == list(chain.NODES)


def test_every_profile_and_stage_exists():
    assert [profile(name).name for name in chain.PROFILES] == list(chain.PROFILES)
    assert all(hasattr(Profile(), stage) for stage in chain.STAGES)
    assert set(chain.STAGES_OF) == set(chain.NODES)
    assert {stage for stages in chain.STAGES_OF.values() for stage in stages} == set(chain.STAGES)


def test_topics_name_nodes_that_exist():
    for name, topic in chain.TOPICS.items():
        assert topic.publisher in ('', *chain.NODES), name
        assert set(topic.needed_by) <= set(chain.NODES), name
        assert topic.depth > 0
        if topic.publisher and topic.needed_by:
            first = chain.NODES.index(topic.publisher)
            assert all(chain.NODES.index(node) > first for node in topic.needed_by), name

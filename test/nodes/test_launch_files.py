# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
The launch files, alone and in a group with a namespace and remapped topics.

Each test runs with strict stand-ins (launch_stand_in.py) and, where they are installed, with the
real launch and launch_ros.
"""

import importlib.util
from pathlib import Path
import sys
from types import ModuleType

from hooc_perception.errors import HoocError
import pytest
import yaml

CHAIN = ('ingestion_node', 'classification_node', 'candidate_node', 'parsing_node')
spec = importlib.util.spec_from_file_location('launch_stand_in', Path(__file__).with_name(
    'launch_stand_in.py'))
stand_in = importlib.util.module_from_spec(spec)
spec.loader.exec_module(stand_in)


def has_launch_ros():
    try:
        import launch_ros.actions  # noqa: F401
    except ImportError:
        return False
    return True


def really_started(node, context):
    """Return what a launch_ros Node would start."""
    from launch.utilities import perform_substitutions
    node._perform_substitutions(context)
    context.extend_locals({'ros_specific_arguments': {
        'name': f'__node:={node._Node__expanded_node_name}',
        'ns': f'__ns:={node.expanded_node_namespace}'}})
    command = [perform_substitutions(context, list(part)) for part in node.cmd]
    rules = dict(b.split(':=', 1) for a, b in zip(command, command[1:]) if a == '-r')
    files = [b for a, b in zip(command, command[1:]) if a == '--params-file']
    own = {}
    for path in files[-1:]:
        for section in yaml.safe_load(Path(path).read_text()).values():
            own |= section['ros__parameters']
    namespace = rules.pop('__ns', '')
    return {'executable': Path(command[0]).name, 'name': rules.pop('__node'),
            'namespace': namespace, 'files': files[:-1], 'parameters': own,
            'respawn': node._ExecuteLocal__respawn, 'remaps': list(rules.items())}


@pytest.fixture(params=['stand-in', 'real'])
def started(request, monkeypatch, repository, tmp_path):
    """Return a function that returns what a launch file starts, given its arguments."""
    packages = ModuleType('ament_index_python.packages')
    packages.get_package_share_directory = lambda name: str(repository)
    packages.get_package_prefix = lambda name: str(tmp_path)
    packages.PackageNotFoundError = KeyError
    if request.param == 'stand-in':
        stand_in.install(monkeypatch)
        monkeypatch.setitem(sys.modules, 'ament_index_python', ModuleType('ament_index_python'))
        monkeypatch.setitem(sys.modules, 'ament_index_python.packages', packages)
        new_context, is_node, start = stand_in.Context, stand_in.Node, stand_in.Node.started
    else:
        if not has_launch_ros():
            pytest.skip('launch and launch_ros are not installed')
        import ament_index_python.packages as real
        from launch import LaunchContext
        from launch_ros.actions import Node
        import launch_ros.substitutions.executable_in_package as in_package
        monkeypatch.setattr(real, 'get_package_share_directory',
                            packages.get_package_share_directory)
        monkeypatch.setattr(in_package.ExecutableInPackage, 'perform',
                            lambda self, context: self.executable[0].perform(context))
        new_context, is_node, start = LaunchContext, Node, really_started

    def run(file, **arguments):
        context = new_context()
        context.launch_configurations.update(arguments)
        found = []

        def visit(entity):
            if isinstance(entity, is_node):
                # As in launch: a process is described now and started after the whole file.
                found.append(start(entity, context))
                return
            for inner in entity.visit(context) or ():
                visit(inner)

        visit(stand_in.load(repository / file))
        return found
    return run


@pytest.fixture
def model(tmp_path):
    folder = tmp_path / 'a: model'       # no YAML
    folder.mkdir()
    return str(folder)


def test_perception_starts_the_chain(started, repository, model, tmp_path):
    file = tmp_path / 'p.yaml'
    file.write_text('{}')
    nodes = started('launch/perception.launch.py', model=model, cameras='[left, right]',
                    target_frame='1', seed='3', use_sim_time='True', params_file=str(file),
                    profile='fast', camera_driver='zed')
    assert tuple(n['name'] for n in nodes) == CHAIN == tuple(n['executable'] for n in nodes)
    for node in nodes:
        assert node['namespace'] == '/hooc' and node['respawn'] is True
        # The file comes first: what is given wins.
        assert node['files'] == [str(file)] and node['remaps'] == []
        assert {**node['parameters'], 'cameras': list(node['parameters']['cameras'])} == {
            'model': model, 'profile': 'fast', 'cameras': ['left', 'right'],
            'camera_driver': 'zed', 'target_frame': '1', 'seed': 3, 'use_sim_time': True,
            'autostart': True}


@pytest.mark.parametrize('given, left', [
    ({}, {}), ({'seed': '0', 'use_sim_time': 'false'}, {'seed': 0, 'use_sim_time': False}),
    ({'cameras': '[]'}, {}), ({'target_frame': 'rig'}, {'target_frame': 'rig'}),
    ({'wait_for_stages': 'yes'}, {'wait_for_stages': True})])
def test_what_is_not_given_is_up_to_the_file(started, repository, model, given, left):
    nodes = started('launch/perception.launch.py', model=model, **given)
    assert len(nodes) == 4
    for node in nodes:
        assert node['files'] == [str(repository / 'config' / 'perception.yaml')]
        assert node['parameters'] == {'model': model, 'autostart': True, **left}


def test_replay_plays_a_bag_into_the_chain_once_it_is_active(started, repository, model):
    bag = repository / 'bags' / 'demo'
    player, *nodes = started('launch/replay.launch.py', model=model, bag=str(bag), rate='2',
                             profile='fast')
    assert tuple(n['name'] for n in nodes) == CHAIN
    assert player['executable'] == 'replay_node' and player['namespace'] == '/hooc'
    assert player['parameters'] == {'bag': str(bag), 'rate': 2.0, 'loop': False,
                                    'autostart': True, 'wait_for_stages': True}
    assert type(player['parameters']['rate']) is float
    for node in nodes:
        assert node['parameters'] == {'model': model, 'profile': 'fast', 'autostart': True,
                                      'wait_for_stages': True}


def test_a_robot_cell_includes_it_with_namespace_and_remapped_cameras(started, model):
    nodes = started('examples/robot_cell.launch.py', model=model)
    assert tuple(n['name'] for n in nodes) == CHAIN
    for node in nodes:
        assert node['namespace'] == '/cell/hooc' and node['respawn'] is True
        assert dict(node['remaps'])['left/depth/image_raw'] == '/cell/left/depth/image_rect_raw'
        assert list(node['parameters']['cameras']) == ['left', 'right']


@pytest.mark.parametrize('name, text, words', [
    ('seed', 'abc', 'whole number'), ('use_sim_time', 'maybe', 'true or false'),
    ('respawn', '2', 'true or false'), ('autostart', 'x', 'true or false'),
    ('cameras', '[left', 'list of names'), ('cameras', '{a: b}', 'list of names'),
    ('cameras', '[1, 2]', 'list of names'), ('params_file', 'nowhere.yaml', 'no such file'),
    ('model', 'nowhere', 'no such file'), ('rate', 'quick', 'give a number'),
    ('rate', 'nan', 'give a number'), ('loop', 'ever', 'true or false'),
    ('bag', 'nowhere', 'no such file')])
def test_an_argument_that_cannot_be_meant_is_named(started, repository, model, name, text, words):
    arguments = {'model': model, 'bag': str(repository / 'bags' / 'demo'), name: text}
    with pytest.raises(HoocError, match=f'argument {name} is .*{words}'):
        started('launch/replay.launch.py', **arguments)


def test_an_unknown_profile_is_refused(started, model):
    with pytest.raises(RuntimeError, match='"profile" provided value "bset".*paper'):
        started('launch/perception.launch.py', model=model, profile='bset')

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
The launch files run to their end and bring every node up in the right order.

launch and launch_ros exist on ROS installations only (what PyPI calls `launch` is something
else). Where they are missing, stand-ins with the arguments of the real classes take their
place; where they are there, test_package.py loads the files with them.
"""

import importlib.util
import sys
from types import ModuleType, SimpleNamespace

import pytest
import yaml

pytest.importorskip('rclpy')

CHAIN = ('ingestion_node', 'classification_node', 'candidate_node', 'parsing_node')
GIVEN = {'model': '~/m', 'profile': 'fast', 'cameras': '[left, right]', 'target_frame': 'table',
         'seed': '3', 'use_sim_time': 'True', 'params_file': '/p.yaml', 'namespace': 'hooc',
         'autostart': 'true', 'respawn': 'true'}


def recorder(kind, required=(), optional=(), positional=0):
    """Return a class that notes its arguments and refuses those that the real one refuses."""
    def __init__(self, *args, **kwargs):
        assert len(args) <= positional, f'{kind} takes {positional} positional arguments'
        assert set(required) <= set(kwargs), f'{kind} needs {required}'
        unknown = set(kwargs) - set(required) - set(optional)
        assert not unknown, f'{kind} knows no {unknown}'
        self.args, self.kind = args, kind
        self.__dict__.update(kwargs)
    return type(kind, (), {'__init__': __init__})


@pytest.fixture
def launch(monkeypatch, repository):
    """Put the stand-ins where the files import them; return LaunchConfiguration's values."""
    action = ('condition',)
    configuration = recorder('LaunchConfiguration', optional=('default',), positional=1)
    configuration.perform = lambda self, context: GIVEN[self.args[0]]
    modules = {
        'launch': {'LaunchDescription': recorder('LaunchDescription', positional=1),
                   'LaunchContext': object, 'LaunchDescriptionEntity': object},
        'launch.actions': {
            'DeclareLaunchArgument': recorder(
                'DeclareLaunchArgument', (), ('default_value', 'description', 'choices', *action),
                1),
            'EmitEvent': recorder('EmitEvent', ('event',), action),
            'IncludeLaunchDescription': recorder(
                'IncludeLaunchDescription', (), ('launch_arguments', *action), 1),
            'OpaqueFunction': recorder('OpaqueFunction', ('function',), ('args', 'kwargs')),
            'RegisterEventHandler': recorder('RegisterEventHandler', (), action, 1)},
        'launch.conditions': {'IfCondition': recorder('IfCondition', positional=1)},
        'launch.event_handlers': {'OnProcessStart': recorder(
            'OnProcessStart', (), ('target_action', 'on_start'))},
        'launch.events': {'matches_action': lambda action: lambda other: other is action},
        'launch.substitutions': {'LaunchConfiguration': configuration},
        'launch.launch_description_sources': {'PythonLaunchDescriptionSource': recorder(
            'PythonLaunchDescriptionSource', positional=1)},
        'launch_ros': {},
        'launch_ros.actions': {'LifecycleNode': recorder(
            'LifecycleNode', ('name', 'namespace'),
            ('package', 'executable', 'parameters', 'output', 'remappings', 'respawn',
             'respawn_delay', *action))},
        'launch_ros.event_handlers': {'OnStateTransition': recorder(
            'OnStateTransition', ('entities',),
            ('target_lifecycle_node', 'transition', 'start_state', 'goal_state', 'matcher'))},
        'launch_ros.events': {},
        'launch_ros.events.lifecycle': {'ChangeState': recorder(
            'ChangeState', ('lifecycle_node_matcher', 'transition_id'))},
        'launch_ros.parameter_descriptions': {'ParameterValue': recorder(
            'ParameterValue', (), ('value_type',), 1)},
    }
    for name, content in modules.items():
        module = ModuleType(name)
        vars(module).update(content)
        monkeypatch.setitem(sys.modules, name, module)
    packages = ModuleType('ament_index_python.packages')
    packages.get_package_share_directory = lambda name: str(repository)
    monkeypatch.setitem(sys.modules, 'ament_index_python', ModuleType('ament_index_python'))
    monkeypatch.setitem(sys.modules, 'ament_index_python.packages', packages)

    def load(name):
        spec = importlib.util.spec_from_file_location(
            name, repository / 'launch' / f'{name}.launch.py')
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return module.generate_launch_description().args[0]
    return load


def order_of(actions, node):
    """Return the places of a node, its activation handler and its configuration."""
    kinds = []
    for action in actions:
        if action is node:
            kinds.append('node')
        elif action.kind == 'RegisterEventHandler' and action.args[0].kind == 'OnProcessStart':
            if action.args[0].target_action is node:
                assert order_of(action.args[0].on_start, node) == ['configure']
                kinds.append('configure')
        elif action.kind == 'RegisterEventHandler' and (
                action.args[0].target_lifecycle_node is node):
            assert (action.args[0].start_state, action.args[0].goal_state) == (
                'configuring', 'inactive')
            assert action.args[0].entities[0].event.transition_id == 3      # activate
            kinds.append('handler')
        elif action.kind == 'EmitEvent' and action.event.lifecycle_node_matcher(node):
            assert action.event.transition_id == 1                          # configure
            kinds.append('configure')
    return kinds


def test_perception_starts_the_chain(launch, repository):
    description = launch('perception')
    declared = {a.args[0] for a in description if a.kind == 'DeclareLaunchArgument'}
    assert declared == set(GIVEN)
    opaque, = (a for a in description if a.kind == 'OpaqueFunction')
    actions = opaque.function(SimpleNamespace())
    nodes = [a for a in actions if a.kind == 'LifecycleNode']
    assert tuple(n.name for n in nodes) == CHAIN == tuple(n.executable for n in nodes)
    for node in nodes:
        # A handler hears only what happens after it was registered.
        assert order_of(actions, node) == ['handler', 'configure', 'node']
        assert node.respawn.perform(None) == 'true'
        # What is given comes after the file and wins.
        params, own = node.parameters
        assert params == '/p.yaml' and own['cameras'] == ['left', 'right']
        assert own['seed'] == 3 and own['use_sim_time'] is True and own['model'].startswith('/')
        assert own['profile'] == 'fast' and own['target_frame'] == 'table'
    default, = (a.default_value for a in description if a.kind == 'DeclareLaunchArgument'
                and a.args[0] == 'params_file')
    assert yaml.safe_load(open(default))


@pytest.mark.parametrize('given, left', [
    ({}, {}), ({'seed': '0', 'use_sim_time': 'false'}, {'seed': 0, 'use_sim_time': False}),
    ({'cameras': '[]'}, {}), ({'target_frame': 'rig'}, {'target_frame': 'rig'})])
def test_what_is_not_given_is_up_to_the_file(launch, monkeypatch, given, left):
    description = launch('perception')
    defaults = {a.args[0]: a.default_value for a in description
                if a.kind == 'DeclareLaunchArgument' and hasattr(a, 'default_value')}
    for name, value in {**defaults, **given}.items():
        monkeypatch.setitem(GIVEN, name, value)
    opaque, = (a for a in description if a.kind == 'OpaqueFunction')
    nodes = [a for a in opaque.function(SimpleNamespace()) if a.kind == 'LifecycleNode']
    assert len(nodes) == 4
    for node in nodes:
        params, own = node.parameters
        assert params.endswith('perception.yaml')
        assert {key: value for key, value in own.items() if key != 'model'} == left


def test_replay_plays_a_bag_into_it(launch):
    description = launch('replay')
    declared = {a.args[0] for a in description if a.kind == 'DeclareLaunchArgument'}
    assert {'bag', 'model', 'rate', 'loop', 'namespace'} <= declared
    player, = (a for a in description if a.kind == 'LifecycleNode')
    assert player.executable == 'replay_node'
    kinds = order_of(description, player)
    assert kinds == ['handler', 'node', 'configure']
    include, = (a for a in description if a.kind == 'IncludeLaunchDescription')
    assert include.args[0].args[0].endswith('perception.launch.py')

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
What launch 3.4 and launch_ros 0.26 (Jazzy) do with a description, as far as our files use it.

They exist on ROS installations only (what PyPI calls `launch` is something else). The stand-ins
refuse what the real classes refuse, and evaluate when those do: configurations belong to a scope,
and an action that is executed after it was popped does not know them any more.
"""

import importlib.util
import sys
from types import ModuleType
from typing import List

import yaml

MISSING = object()


class Context:
    """The LaunchContext: configurations in scopes; what PushRosNamespace and SetRemap set."""

    def __init__(self):
        self.launch_configurations = {}
        self.scopes = []


def text_of(value, context):
    """Perform text, a substitution, or a sequence of them."""
    if isinstance(value, str):
        return value
    if isinstance(value, LaunchConfiguration):
        return value.perform(context)
    assert isinstance(value, (list, tuple)), f'{value!r} is no substitution'
    return ''.join(text_of(part, context) for part in value)


class LaunchConfiguration:
    def __init__(self, variable_name, *, default=MISSING):
        self.name, self.default = variable_name, default

    def perform(self, context):
        if self.name in context.launch_configurations:
            return context.launch_configurations[self.name]
        if self.default is MISSING:
            raise RuntimeError(f"launch configuration '{self.name}' does not exist")
        return text_of(self.default, context)


class LaunchDescription:
    def __init__(self, entities=None):
        self.entities = list(entities or [])

    def visit(self, context):
        return self.entities

    def declared(self):
        """Return the DeclareLaunchArgument of this file and of the files that it includes."""
        for entity in self.entities:
            if isinstance(entity, DeclareLaunchArgument):
                yield entity
            elif isinstance(entity, IncludeLaunchDescription):
                yield from entity.source.load().declared()
            elif isinstance(entity, GroupAction):
                yield from LaunchDescription(entity.actions).declared()


class DeclareLaunchArgument:
    def __init__(self, name, *, default_value=None, description=None, choices=None):
        assert choices is None or default_value in (None, *choices)
        self.name, self.default_value, self.choices = name, default_value, choices

    def visit(self, context):
        known = context.launch_configurations
        if self.name not in known:
            if self.default_value is None:
                raise RuntimeError(f"Required launch argument '{self.name}' was not provided")
            known[self.name] = text_of(self.default_value, context)
        if self.choices is not None and known[self.name] not in self.choices:
            raise RuntimeError(f'Argument "{self.name}" provided value "{known[self.name]}" is '
                               f'not valid. Valid options are: {self.choices}')


class OpaqueFunction:
    def __init__(self, *, function):
        self.function = function

    def visit(self, context):
        return self.function(context)


class PythonLaunchDescriptionSource:
    def __init__(self, path):
        self.path = path

    def load(self):
        return load(self.path)


class IncludeLaunchDescription:
    def __init__(self, source, *, launch_arguments=None):
        self.source, self.arguments = source, tuple(launch_arguments or ())

    def visit(self, context):
        description = self.source.load()
        given = {name for name, _ in self.arguments}
        for argument in description.declared():
            # The configurations of the including file do not count.
            if argument.default_value is None and argument.name not in given:
                raise RuntimeError('Included launch description missing required argument '
                                   f"'{argument.name}', given: {sorted(given)}")
        for name, value in self.arguments:
            context.launch_configurations[name] = text_of(value, context)
        return [description]


class GroupAction:
    def __init__(self, actions, *, scoped=True):
        self.actions = list(actions)
        assert scoped

    def visit(self, context):
        def push(context):
            context.scopes.append(dict(context.launch_configurations))

        def pop(context):
            context.launch_configurations = context.scopes.pop()
        return [OpaqueFunction(function=push), *self.actions, OpaqueFunction(function=pop)]


class PushRosNamespace:
    def __init__(self, namespace):
        self.namespace = namespace

    def visit(self, context):
        known, own = context.launch_configurations, text_of(self.namespace, context)
        known['ros_namespace'] = joined(known.get('ros_namespace', ''), own)


class SetRemap:
    def __init__(self, src, dst):
        self.rule = src, dst

    def visit(self, context):
        known = context.launch_configurations
        known['ros_remaps'] = [*known.get('ros_remaps', []),
                               tuple(text_of(x, context) for x in self.rule)]


class ParameterValue:
    def __init__(self, value, value_type=None):
        texts = value if value_type == List[str] else [value]
        if value_type not in (str, List[str]) or not isinstance(texts, list) or not all(
                isinstance(x, (str, LaunchConfiguration)) for x in texts):
            raise TypeError(f'{value=} is not an instance of {value_type}')
        self.value, self.kind = value, value_type

    def evaluate(self, context):
        if self.kind is str:
            return text_of(self.value, context)
        return [text_of(x, context) for x in self.value]


class Node:
    def __init__(self, *, executable, package=None, name=None, namespace=None, parameters=None,
                 remappings=None, output='log', respawn=False, respawn_delay=None):
        assert package and isinstance(respawn, (bool, str, LaunchConfiguration))
        self.executable, self.name, self.namespace = executable, name, namespace
        self.parameters, self.respawn = list(parameters or []), respawn

    def started(self, context):
        """Return what is started."""
        known, files, own = context.launch_configurations, [], {}
        for entry in self.parameters:
            if isinstance(entry, dict):
                own |= {name: parameter(value, context) for name, value in entry.items()}
            else:
                files.append(text_of(entry, context))
        return {'executable': self.executable, 'name': self.name,
                'namespace': joined(known.get('ros_namespace', ''), self.namespace or ''),
                'files': files, 'parameters': own, 'respawn': self.respawn,
                'remaps': known.get('ros_remaps', [])}


def parameter(value, context):
    """Evaluate a value of a dictionary of parameters, where text is YAML."""
    if isinstance(value, ParameterValue):
        return value.evaluate(context)
    if isinstance(value, (str, LaunchConfiguration)):
        value = yaml.safe_load(text_of(value, context) or "''")
    if isinstance(value, (list, tuple)):
        if not value or len({type(x) for x in value}) > 1:
            raise TypeError('Expected a non-empty sequence, with items of uniform type')
    elif not isinstance(value, (bool, int, float, str)):
        raise TypeError(f'Allowed value types are bytes, bool, int, float, str. Got {type(value)}')
    return value


def joined(outer, inner):
    """Return a namespace inside of another one."""
    if not inner:
        return outer
    return inner if inner.startswith('/') else f'{outer.rstrip("/")}/{inner}'


def load(path):
    """Return the description of a launch file."""
    spec = importlib.util.spec_from_file_location('loaded_launch_file', path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.generate_launch_description()


def install(monkeypatch):
    """Put the stand-ins where launch files import them from."""
    places = {
        'launch': (LaunchDescription,), 'launch.substitutions': (LaunchConfiguration,),
        'launch.actions': (DeclareLaunchArgument, GroupAction, IncludeLaunchDescription,
                           OpaqueFunction),
        'launch.launch_description_sources': (PythonLaunchDescriptionSource,), 'launch_ros': (),
        'launch_ros.actions': (Node, PushRosNamespace, SetRemap),
        'launch_ros.parameter_descriptions': (ParameterValue,)}
    for name, classes in places.items():
        module = ModuleType(name)
        vars(module).update({c.__name__: c for c in classes})
        monkeypatch.setitem(sys.modules, name, module)
    vars(sys.modules['launch']).update(LaunchContext=Context, LaunchDescriptionEntity=object)

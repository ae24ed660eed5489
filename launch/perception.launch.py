# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Start the four nodes of the chain for live cameras, and configure and activate them.

This needs a ROS installation; `hooc up` does the same without one.

    ros2 launch hooc_perception perception.launch.py model:=MODEL [cameras:="[left, right]"]
"""

from collections.abc import Callable
import os
from typing import Any

from ament_index_python.packages import get_package_share_directory
from hooc_perception.chain import CHAIN
from launch import LaunchContext, LaunchDescription, LaunchDescriptionEntity
from launch.actions import DeclareLaunchArgument, EmitEvent, OpaqueFunction, RegisterEventHandler
from launch.conditions import IfCondition
from launch.event_handlers import OnProcessStart
from launch.events import matches_action
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import LifecycleNode
from launch_ros.event_handlers import OnStateTransition
from launch_ros.events.lifecycle import ChangeState
from lifecycle_msgs.msg import Transition
import yaml


def lifecycle_node(name: str, namespace: LaunchConfiguration, parameters: list[Any],
                   autostart: LaunchConfiguration) -> list[LaunchDescriptionEntity]:
    """Return the actions that start one node and, with `autostart`, activate it."""
    node = LifecycleNode(package='hooc_perception', executable=name, name=name,
                         namespace=namespace, parameters=parameters, output='screen',
                         respawn=LaunchConfiguration('respawn'), respawn_delay=2.0)

    def change(transition: int) -> EmitEvent:
        return EmitEvent(event=ChangeState(lifecycle_node_matcher=matches_action(node),
                                           transition_id=transition),
                         condition=IfCondition(autostart))

    activate = RegisterEventHandler(OnStateTransition(
        target_lifecycle_node=node, start_state='configuring', goal_state='inactive',
        entities=[change(Transition.TRANSITION_ACTIVATE)]))
    # Every process that starts is configured, also one that replaces a dead one.
    configure = RegisterEventHandler(OnProcessStart(
        target_action=node, on_start=[change(Transition.TRANSITION_CONFIGURE)]))
    return [activate, configure, node]


def _boolean(text: str) -> bool:
    """Return the Boolean value of an argument."""
    return text.lower() in ('true', '1', 'yes', 'on')


def chain(context: LaunchContext) -> list[LaunchDescriptionEntity]:
    """Return the actions of the four nodes; the arguments are known as text only now."""
    given = {name: LaunchConfiguration(name).perform(context) for name in (
        'model', 'profile', 'cameras', 'target_frame', 'seed', 'use_sim_time', 'params_file')}
    own: dict[str, Any] = {'model': os.path.abspath(os.path.expanduser(given['model']))}
    kinds: dict[str, Callable[[str], Any]] = {
        'profile': str, 'target_frame': str, 'seed': int, 'use_sim_time': _boolean,
        'cameras': yaml.safe_load}
    # The file, which comes first, sets what is not given.
    for name, kind in kinds.items():
        if given[name] and (value := kind(given[name])) != []:
            own[name] = value
    actions: list[LaunchDescriptionEntity] = []
    for name in CHAIN:
        actions += lifecycle_node(name, LaunchConfiguration('namespace'),
                                  [given['params_file'], own], LaunchConfiguration('autostart'))
    return actions


def generate_launch_description() -> LaunchDescription:
    """Return the description that `ros2 launch` runs."""
    params = os.path.join(get_package_share_directory('hooc_perception'), 'config',
                          'perception.yaml')
    return LaunchDescription([
        DeclareLaunchArgument('model', description='model folder that hooc train wrote'),
        DeclareLaunchArgument('profile', default_value='',
                              description='paper, best or fast; empty: see params_file'),
        DeclareLaunchArgument('cameras', default_value='',
                              description='list of names; empty: see params_file'),
        DeclareLaunchArgument('target_frame', default_value='',
                              description='empty: see params_file'),
        DeclareLaunchArgument('seed', default_value='', description='empty: see params_file'),
        DeclareLaunchArgument('namespace', default_value='hooc'),
        DeclareLaunchArgument('use_sim_time', default_value='',
                              description='true or false; empty: see params_file'),
        DeclareLaunchArgument('autostart', default_value='true',
                              description='configure and activate the nodes'),
        DeclareLaunchArgument('respawn', default_value='true',
                              description='restart a node that has died'),
        DeclareLaunchArgument(
            'params_file', default_value=params,
            description='parameters of the nodes; the model and the nodes have defaults for '
                        'what neither this file nor an argument sets'),
        OpaqueFunction(function=chain),
    ])

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
The four nodes of the chain for live cameras, brought to active one after the other.

For ROS installations; elsewhere `hooc up` does the same.

    ros2 launch hooc_perception perception.launch.py model:=MODEL [cameras:="[left, right]"]
"""

import os

from ament_index_python.packages import get_package_share_directory
from hooc_perception.chain import CHAIN
from launch import LaunchDescription
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


def lifecycle_node(name, namespace, parameters, autostart):
    """Return the actions that start one node and, with `autostart`, bring it to active."""
    node = LifecycleNode(package='hooc_perception', executable=name, name=name,
                         namespace=namespace, parameters=parameters, output='screen',
                         respawn=LaunchConfiguration('respawn'), respawn_delay=2.0)

    def change(transition):
        return EmitEvent(event=ChangeState(lifecycle_node_matcher=matches_action(node),
                                           transition_id=transition),
                         condition=IfCondition(autostart))

    activate = RegisterEventHandler(OnStateTransition(
        target_lifecycle_node=node, start_state='configuring', goal_state='inactive',
        entities=[change(Transition.TRANSITION_ACTIVATE)]))
    # Every process that starts is configured, also one that takes the place of a dead one.
    configure = RegisterEventHandler(OnProcessStart(
        target_action=node, on_start=[change(Transition.TRANSITION_CONFIGURE)]))
    return [activate, configure, node]


def _truth(text):
    """Return the truth value of an argument."""
    return text.lower() in ('true', '1', 'yes', 'on')


def chain(context):
    """Return the actions of the four nodes; only now are the arguments known as text."""
    given = {name: LaunchConfiguration(name).perform(context) for name in (
        'model', 'profile', 'cameras', 'target_frame', 'seed', 'use_sim_time', 'params_file')}
    own = {'model': os.path.abspath(os.path.expanduser(given['model']))}
    # What is not given is up to the file, which stands before.
    for name, kind in (('profile', str), ('target_frame', str), ('seed', int),
                       ('use_sim_time', _truth), ('cameras', yaml.safe_load)):
        if given[name] and (value := kind(given[name])) != []:
            own[name] = value
    actions = []
    for name in CHAIN:
        actions += lifecycle_node(name, LaunchConfiguration('namespace'),
                                  [given['params_file'], own], LaunchConfiguration('autostart'))
    return actions


def generate_launch_description():
    """Return the description that `ros2 launch` runs."""
    params = os.path.join(get_package_share_directory('hooc_perception'), 'config',
                          'perception.yaml')
    return LaunchDescription([
        DeclareLaunchArgument('model', description='folder that hooc train wrote'),
        DeclareLaunchArgument('profile', default_value='',
                              description='paper, best or fast; empty: see params_file'),
        DeclareLaunchArgument('cameras', default_value='',
                              description='names as a list; empty: see params_file'),
        DeclareLaunchArgument('target_frame', default_value='',
                              description='empty: see params_file'),
        DeclareLaunchArgument('seed', default_value='', description='empty: see params_file'),
        DeclareLaunchArgument('namespace', default_value='hooc'),
        DeclareLaunchArgument('use_sim_time', default_value='',
                              description='true or false; empty: see params_file'),
        DeclareLaunchArgument('autostart', default_value='true',
                              description='configure and activate the nodes'),
        DeclareLaunchArgument('respawn', default_value='true',
                              description='start a node again that has died'),
        DeclareLaunchArgument(
            'params_file', default_value=params,
            description='parameters of the nodes; what neither it nor an argument says is '
                        "the model's or the nodes' default"),
        OpaqueFunction(function=chain),
    ])

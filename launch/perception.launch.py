# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Start the four nodes of the chain for live cameras; they configure and activate themselves.

This needs a ROS installation; `hooc up` does the same without one.

    ros2 launch hooc_perception perception.launch.py model:=MODEL [cameras:="[left, right]"]

Other launch files may include it, also in a namespace and with remapped topics: see
examples/robot_cell.launch.py.
"""

import os
from typing import Any, List

from ament_index_python.packages import get_package_share_directory
from hooc_perception import launch_arguments as kinds
from hooc_perception.chain import CHAIN, PROFILES
from launch import LaunchContext, LaunchDescription, LaunchDescriptionEntity
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

# Argument -> what its text means. They are parameters of the nodes.
PARAMETERS = {
    'model': kinds.path, 'profile': kinds.text, 'cameras': kinds.names,
    'camera_driver': kinds.text, 'target_frame': kinds.text, 'seed': kinds.whole_number,
    'use_sim_time': kinds.boolean, 'autostart': kinds.boolean, 'wait_for_stages': kinds.boolean}
OTHERS = {'namespace': kinds.text, 'params_file': kinds.path, 'respawn': kinds.boolean}


def typed(value: Any) -> Any:
    """Return the value of a parameter so that launch_ros does not read it as YAML."""
    kinds_of_text = {str: str, list: List[str]}     # launch knows no list[str]
    kind = kinds_of_text.get(type(value))
    return ParameterValue(value, value_type=kind) if kind else value


def chain(context: LaunchContext) -> list[LaunchDescriptionEntity]:
    """Return the four nodes; all is evaluated now, for the scope may end before they start."""
    given = kinds.given({name: LaunchConfiguration(name).perform(context)
                         for name in (*PARAMETERS, *OTHERS)}, {**PARAMETERS, **OTHERS})
    # The file, which comes first, sets what is not given.
    own = {name: typed(value) for name, value in given.items() if name in PARAMETERS}
    files = [given['params_file']] if 'params_file' in given else []
    return [Node(package='hooc_perception', executable=name, name=name,
                 namespace=given.get('namespace', ''), parameters=[*files, own], output='screen',
                 respawn=given.get('respawn', False), respawn_delay=2.0)
            for name in CHAIN]


def generate_launch_description() -> LaunchDescription:
    """Return the description that `ros2 launch` runs."""
    params = os.path.join(get_package_share_directory('hooc_perception'), 'config',
                          'perception.yaml')
    return LaunchDescription([
        DeclareLaunchArgument('model', description='model folder that hooc train wrote'),
        DeclareLaunchArgument('profile', default_value='', choices=['', *PROFILES],
                              description='empty: see params_file'),
        DeclareLaunchArgument('cameras', default_value='',
                              description='list of names; empty: see params_file'),
        DeclareLaunchArgument('camera_driver', default_value='',
                              description='such as realsense2; empty: see params_file'),
        DeclareLaunchArgument('target_frame', default_value='',
                              description='empty: see params_file'),
        DeclareLaunchArgument('seed', default_value='', description='empty: see params_file'),
        DeclareLaunchArgument('namespace', default_value='hooc',
                              description='of the nodes, inside of the one that includes it'),
        DeclareLaunchArgument('use_sim_time', default_value='',
                              description='true or false; empty: see params_file'),
        DeclareLaunchArgument('autostart', default_value='true',
                              description='the nodes configure and activate themselves'),
        DeclareLaunchArgument('wait_for_stages', default_value='',
                              description='a node becomes active after those that need its '
                              'topics, for recordings; empty: see params_file'),
        DeclareLaunchArgument('respawn', default_value='true',
                              description='restart a node that has died'),
        DeclareLaunchArgument(
            'params_file', default_value=params,
            description='parameters of the nodes; the model and the nodes have defaults for '
                        'what neither this file nor an argument sets'),
        OpaqueFunction(function=chain),
    ])

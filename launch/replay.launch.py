# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Play a bag as live cameras, and start the chain that parses it.

    ros2 launch hooc_perception replay.launch.py bag:=BAG model:=MODEL

It takes the arguments of perception.launch.py as well. The bag is played once the whole chain is
active, so that nothing of it is lost.
"""

import os

from ament_index_python.packages import get_package_share_directory
from hooc_perception import launch_arguments as kinds
from launch import LaunchContext, LaunchDescription, LaunchDescriptionEntity
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription, OpaqueFunction
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

ARGUMENTS = {'bag': kinds.path, 'rate': kinds.number, 'loop': kinds.boolean,
             'namespace': kinds.text, 'autostart': kinds.boolean}


def player(context: LaunchContext) -> list[LaunchDescriptionEntity]:
    """Return the node that plays the bag."""
    own = kinds.given({name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS},
                      ARGUMENTS)
    namespace = own.pop('namespace', '')
    own.update(bag=ParameterValue(own['bag'], value_type=str), wait_for_stages=True)
    return [Node(package='hooc_perception', executable='replay_node', name='replay_node',
                 namespace=namespace, parameters=[own], output='screen')]


def generate_launch_description() -> LaunchDescription:
    """Return the description that `ros2 launch` runs."""
    here = os.path.join(get_package_share_directory('hooc_perception'), 'launch')
    return LaunchDescription([
        DeclareLaunchArgument('bag', description='rosbag2 folder, .mcap or .db3 file'),
        DeclareLaunchArgument('model', description='model folder that hooc train wrote'),
        DeclareLaunchArgument('rate', default_value='1.0',
                              description='speed; 0 = as fast as the chain processes frame sets'),
        DeclareLaunchArgument('loop', default_value='false'),
        DeclareLaunchArgument('namespace', default_value='hooc',
                              description='of the nodes, inside of the one that includes it'),
        DeclareLaunchArgument('autostart', default_value='true',
                              description='the nodes configure and activate themselves'),
        OpaqueFunction(function=player),
        IncludeLaunchDescription(
            PythonLaunchDescriptionSource(os.path.join(here, 'perception.launch.py')),
            # What has no default must be passed on; the rest is known there.
            launch_arguments={'model': LaunchConfiguration('model'),
                              'wait_for_stages': 'true'}.items()),
    ])

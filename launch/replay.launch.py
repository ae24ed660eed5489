# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Play a bag as live cameras, and start the chain that parses it.

    ros2 launch hooc_perception replay.launch.py bag:=BAG model:=MODEL
"""

import os

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import (
    DeclareLaunchArgument,
    EmitEvent,
    IncludeLaunchDescription,
    RegisterEventHandler,
)
from launch.events import matches_action
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import LifecycleNode
from launch_ros.event_handlers import OnStateTransition
from launch_ros.events.lifecycle import ChangeState
from launch_ros.parameter_descriptions import ParameterValue
from lifecycle_msgs.msg import Transition


def generate_launch_description() -> LaunchDescription:
    """Return the description that `ros2 launch` runs."""
    here = os.path.join(get_package_share_directory('hooc_perception'), 'launch')
    player = LifecycleNode(
        package='hooc_perception', executable='replay_node', name='replay_node',
        namespace=LaunchConfiguration('namespace'), output='screen',
        parameters=[{'bag': LaunchConfiguration('bag'),
                     'rate': ParameterValue(LaunchConfiguration('rate'), value_type=float),
                     'loop': ParameterValue(LaunchConfiguration('loop'), value_type=bool),
                     'match_timeout_s': 120.0}])

    def change(transition: int) -> EmitEvent:
        return EmitEvent(event=ChangeState(lifecycle_node_matcher=matches_action(player),
                                           transition_id=transition))

    return LaunchDescription([
        DeclareLaunchArgument('bag', description='rosbag2 folder, .mcap or .db3 file'),
        DeclareLaunchArgument('model', description='model folder that hooc train wrote'),
        DeclareLaunchArgument('rate', default_value='1.0',
                              description='speed; 0 = as fast as the chain processes frame sets'),
        DeclareLaunchArgument('loop', default_value='false'),
        DeclareLaunchArgument('namespace', default_value='hooc'),
        # Handlers must be registered before their events occur.
        RegisterEventHandler(OnStateTransition(
            target_lifecycle_node=player, start_state='configuring', goal_state='inactive',
            entities=[change(Transition.TRANSITION_ACTIVATE)])),
        IncludeLaunchDescription(PythonLaunchDescriptionSource(
            os.path.join(here, 'perception.launch.py'))),
        player,
        change(Transition.TRANSITION_CONFIGURE),
    ])

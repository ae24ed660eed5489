# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Include hooc_perception in the launch file of a robot cell with two RealSense cameras.

    ros2 launch hooc_perception robot_cell.launch.py model:=MODEL

Everything runs in the namespace /cell: results are on /cell/hooc/objects/poses. The drivers are
those of realsense-ros, started elsewhere:

    ros2 launch realsense2_camera rs_launch.py camera_namespace:=cell camera_name:=left

The topics are remapped here, as launch files usually do; `camera_driver:=realsense2` or the
parameters image_topic.<camera> and info_topic.<camera> do the same without a group.
"""

import os

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, GroupAction, IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import PushRosNamespace, SetRemap

CAMERAS = ('left', 'right')


def generate_launch_description() -> LaunchDescription:
    """Return the description that `ros2 launch` runs."""
    included = os.path.join(get_package_share_directory('hooc_perception'), 'launch',
                            'perception.launch.py')
    remaps = [SetRemap(f'{camera}/depth/{ours}', f'/cell/{camera}/depth/{driver}')
              for camera in CAMERAS
              for ours, driver in (('image_raw', 'image_rect_raw'),
                                   ('camera_info', 'camera_info'))]
    return LaunchDescription([
        DeclareLaunchArgument('model', description='model folder that hooc train wrote'),
        GroupAction([
            PushRosNamespace('cell'),
            *remaps,
            IncludeLaunchDescription(
                PythonLaunchDescriptionSource(included),
                launch_arguments={'model': LaunchConfiguration('model'),
                                  'cameras': f'[{", ".join(CAMERAS)}]'}.items()),
        ]),
    ])

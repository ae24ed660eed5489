# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Where the images of a camera come from: the topics of its driver."""

from typing import NamedTuple

from hooc_perception.errors import HoocError
from hooc_perception.ros.lifecycle.stage_node import StageNode
from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult
from rclpy.exceptions import InvalidTopicNameException
from rclpy.parameter import Parameter
from rclpy.validate_topic_name import validate_topic_name


class CameraTopics(NamedTuple):
    """The topics of one camera, as they are subscribed: remapping applies to them."""

    image: str
    info: str


# Without a driver: relative to the namespace of the node.
OURS = CameraTopics('<camera>/depth/image_raw', '<camera>/depth/camera_info')
# Depth as the sensor sees it, with the calibration that belongs to it. `<camera>` is the name
# that the driver was started with; sources: the launch files and documentation of each driver.
DRIVERS = {
    # realsense-ros 4.55: camera_name:=<camera>, camera_namespace at its default (README)
    'realsense2': CameraTopics('/camera/<camera>/depth/image_rect_raw',
                               '/camera/<camera>/depth/camera_info'),
    # OrbbecSDK_ROS2: camera_name:=<camera> (ob_camera_node.cpp)
    'orbbec': CameraTopics('/<camera>/depth/image_raw', '/<camera>/depth/camera_info'),
    # Azure_Kinect_ROS_Driver, humble: in the namespace <camera> (k4a_ros_device.cpp)
    'azure_kinect': CameraTopics('/<camera>/depth/image_raw', '/<camera>/depth/camera_info'),
    # kinect2_ros2 and iai_kinect2: base_name:=<camera>. Not image_depth_rect: sd/camera_info has
    # the distortion of the image that is not rectified (kinect2_bridge.cpp)
    'kinect2_bridge': CameraTopics('/<camera>/sd/image_depth', '/<camera>/sd/camera_info'),
    # zed-ros2-wrapper: camera_name:=<camera> (zed_camera_component_video_depth.cpp)
    'zed': CameraTopics('/<camera>/zed_node/depth/depth_registered',
                        '/<camera>/zed_node/depth/camera_info'),
    # zivid-ros: __ns:=/<camera> (README); an image for each call of `capture`
    'zivid': CameraTopics('/<camera>/depth/image', '/<camera>/depth/camera_info'),
}
_MEANINGS = {
    'driver': 'Driver of {}: ' + ', '.join(DRIVERS) + '; empty = camera_driver.',
    'image_topic': 'Topic of the depth images of {}; empty = that of the driver.',
    'info_topic': 'Topic of the camera_info of {}; empty = that of the driver.'}


class TopicParameters:
    """
    The parameters `image_topic.<camera>`, `info_topic.<camera>`, `driver.<camera>` of a node.

    The first two win over the driver, and that of a camera over `camera_driver`.
    """

    def __init__(self, node: StageNode) -> None:
        """Reject changes while the node is configured."""
        self._node = node
        node.add_on_set_parameters_callback(self._on_set)

    def declare(self, name: str) -> None:
        """Declare the parameters of a camera."""
        for kind, meaning in _MEANINGS.items():
            if not self._node.has_parameter(f'{kind}.{name}'):
                self._node.declare_parameter(f'{kind}.{name}', '', ParameterDescriptor(
                    description=meaning.format(name), additional_constraints=(
                        'may change only while the node is unconfigured')))

    def topics(self, name: str, default_driver: str) -> CameraTopics:
        """
        Return the topics of a camera whose parameters are declared.

        :param default_driver: of cameras for which `driver.<camera>` is empty.
        :raises HoocError: if a parameter cannot be used.
        """
        driver, *given = (self._node.get_parameter(f'{kind}.{name}').value for kind in _MEANINGS)
        driver = driver or default_driver
        if driver and driver not in DRIVERS:
            raise HoocError(f'parameter driver.{name} is {driver!r}; choose one of '
                            f'{", ".join(DRIVERS)}, or set image_topic.{name} and '
                            f'info_topic.{name}')
        preset = DRIVERS[driver] if driver else OURS
        topics = CameraTopics(*(own or topic.replace('<camera>', name)
                                for own, topic in zip(given, preset)))
        for kind, topic in zip(('image_topic', 'info_topic'), topics):
            _check(f'{kind}.{name}', topic)
        return topics

    def _on_set(self, parameters: list[Parameter]) -> SetParametersResult:
        for parameter in parameters:
            if parameter.name.partition('.')[0] in _MEANINGS and (
                    self._node.has_parameter(parameter.name)
                    and not self._node.is_unconfigured()):
                return SetParametersResult(successful=False, reason=(
                    f'{parameter.name} is subscribed already: deactivate and clean up '
                    f'{self._node.get_name()} first, then set it and configure again'))
        return SetParametersResult(successful=True)


def _check(parameter: str, topic: str) -> None:
    """Raise HoocError if a topic has no valid name."""
    try:
        validate_topic_name(topic)
    except InvalidTopicNameException as error:
        raise HoocError(f'parameter {parameter} is {topic!r}, which is no name of a topic: '
                        f'{str(error).splitlines()[0]}') from None

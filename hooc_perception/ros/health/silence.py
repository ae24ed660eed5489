# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Why nothing arrives on a topic, as far as the ROS graph tells."""

from rclpy.node import Node
from rclpy.qos import qos_check_compatible, QoSCompatibility
from rclpy.subscription import Subscription


def why_silent(node: Node, name: str, subscription: Subscription) -> tuple[str, str]:
    """
    Return (code, sentence) on why a subscription of a node receives nothing.

    Codes: `no_publisher`, `wrong_type`, `qos_mismatch`, `no_messages`.

    :param name: of the topic as it was subscribed. rclpy remaps the names that it is asked about:
        that of the subscription, which is remapped already, could become another one.
    """
    # rclpy annotates the message class as an instance of it.
    wanted = type_name(subscription.msg_type)   # pyright: ignore[reportArgumentType]
    topic = subscription.topic_name
    publishers = node.get_publishers_info_by_topic(name)
    if not publishers:
        return 'no_publisher', f'nobody publishes {topic}; {_hint(node, topic, wanted)}'
    right = [p for p in publishers if p.topic_type == wanted]
    if not right:
        return 'wrong_type', (f'{topic} is published as {publishers[0].topic_type}, not as '
                              f'{wanted}; remap to a topic of that type')
    reasons = []
    for publisher in right:
        verdict, reason = qos_check_compatible(publisher.qos_profile, subscription.qos_profile)
        if verdict != QoSCompatibility.ERROR:
            return 'no_messages', (
                f'{topic} is published by {publisher.node_name}, but nothing arrives; check '
                'that the driver delivers ("ros2 topic hz" on its machine), then the network: '
                'large messages get lost where multicast or IP fragments are blocked')
        reasons.append(f'{publisher.node_name}: {_plain(reason)}')
    return 'qos_mismatch', (
        f'no publisher of {topic} offers the requested QoS ({"; ".join(reasons)}); leave '
        'image_reliability at auto, or set qos_overrides for this topic')


def type_name(kind: type) -> str:
    """Return the name of a message class in the graph, such as sensor_msgs/msg/Image."""
    package, part, _ = kind.__module__.split('.', 2)
    return f'{package}/{part}/{kind.__name__}'


def _hint(node: Node, topic: str, wanted: str) -> str:
    """Return the fix for a topic that nobody publishes; names similar topics."""
    own = node.get_namespace().rstrip('/')
    others = sorted(
        name for name, kinds in node.get_topic_names_and_types()
        if wanted in kinds and name != topic and node.count_publishers(name)
        and not name.startswith((f'{own}/views/', f'{own}/pixels/')))
    alike = [name for name in others if 'depth' in name] or others
    if not alike:
        return 'start its driver, or check that ROS_DOMAIN_ID is the same on both sides'
    return (f'there is {", ".join(alike[:4])}: set the parameter image_topic.<camera> and '
            'info_topic.<camera>, or camera_driver, or remap it')


def _plain(reason: str) -> str:
    """Return a reason given by rclpy without its prefix and final punctuation."""
    return reason.removeprefix('ERROR: ').strip().rstrip(';.')

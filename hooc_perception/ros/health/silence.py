# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Why nothing arrives on a topic: read off the graph, said in plain words."""

from rclpy.qos import qos_check_compatible, QoSCompatibility


def why_silent(node, subscription):
    """
    Return (code, sentence) on why a subscription hears nothing.

    Codes: `no_publisher`, `wrong_type`, `qos_mismatch`, `no_messages`.

    :param subscription: rclpy Subscription of `node`.
    """
    topic, wanted = subscription.topic_name, type_name(subscription.msg_type)
    publishers = node.get_publishers_info_by_topic(topic)
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
                f'{topic} is published by {publisher.node_name}, but nothing arrives; look '
                'whether the driver delivers ("ros2 topic hz" on its machine), then at the '
                'network: large messages get lost where multicast or fragments are blocked')
        reasons.append(f'{publisher.node_name}: {_plain(reason)}')
    return 'qos_mismatch', (
        f'no publisher of {topic} offers the QoS that is asked for ({"; ".join(reasons)}); leave '
        'image_reliability at auto, or set qos_overrides for this topic')


def type_name(kind):
    """Return the name of a message class as the graph has it: sensor_msgs/msg/Image."""
    package, part, _ = kind.__module__.split('.', 2)
    return f'{package}/{part}/{kind.__name__}'


def _hint(node, topic, wanted):
    """Return what to do about a topic that nobody publishes, naming topics that could be it."""
    own = node.get_namespace().rstrip('/')
    others = sorted(
        name for name, kinds in node.get_topic_names_and_types()
        if wanted in kinds and name != topic and node.count_publishers(name)
        and not name.startswith((f'{own}/views/', f'{own}/pixels/')))
    alike = [name for name in others if 'depth' in name] or others
    if not alike:
        return 'start its driver, or look whether ROS_DOMAIN_ID is the same on both sides'
    return (f'there is {", ".join(alike[:4])}: remap it, or set the parameter cameras to the '
            'names that the drivers use')


def _plain(reason):
    """Return rclpy's reason without its prefix and end."""
    return reason.removeprefix('ERROR: ').strip().rstrip(';.')

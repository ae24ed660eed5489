# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
One QoS profile a topic, by name; each can be overridden by `qos_overrides` parameters.

Large best-effort messages get lost when several images leave at once, so all that we publish
is reliable. What a late subscriber must know is latched.
"""

from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSPolicyKind, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions


def _profile(depth, latched=False, reliable=True):
    """Return keep-last `depth`."""
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST, depth=depth,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE)


# The topic's name without its namespace -> (depth, latched). `<camera>` stands for any camera.
TOPICS = {
    '<camera>/depth/image_raw': (4, False),
    '<camera>/depth/camera_info': (4, False),
    '<camera>/extrinsics': (1, True),
    # Four sets: a node that is busy while the next set arrives still finds whole sets.
    'views/<camera>/depth_rect': (4, False),
    'views/<camera>/camera_info': (4, True),
    'views/<camera>/extrinsics': (4, True),
    'views/<camera>/count': (1, False),
    'views/points': (1, False),
    'views/refused': (4, False),
    'pixels/probabilities': (4, False),
    'pixels/<camera>/labels': (1, False),
    'candidates/poses': (4, False),
    'candidates/attributes': (4, False),
    'candidates/requests': (4, False),
    'candidates/more/poses': (4, False),
    'candidates/more/attributes': (4, False),
    'objects/poses': (1, True),
    'objects/attributes': (1, True),
    'objects/labels': (1, True),
    'objects/<category>/poses': (1, True),
    'objects/markers': (1, True),
    'scene/unexplained': (1, True),
    'scene/summary': (1, True),
    'objects/detections': (1, True),
    '/tf': (100, False),
    '/planning_scene': (10, False),
    'replay/status': (1, True),
}


def qos(topic, reliable=True):
    """
    Return the QoSProfile of a topic by its name in TOPICS.

    :param reliable: False for cameras whose drivers offer best effort only.
    """
    depth, latched = TOPICS[topic]
    return _profile(depth, latched, reliable)


def overridable(reliability=True):
    """
    Return the options that declare a topic's QoS as read-only parameters.

    :param reliability: False where a parameter of our own decides on it.
    """
    kinds = [QoSPolicyKind.HISTORY, QoSPolicyKind.DEPTH, QoSPolicyKind.DURABILITY]
    return QoSOverridingOptions(kinds + [QoSPolicyKind.RELIABILITY] if reliability else kinds)


def auto_reliability(offers):
    """
    Return whether to ask for RELIABLE, given what the publishers of a topic offer.

    Reliable only if every publisher offers it: a reliable reader gets nothing from a
    best-effort writer. Without publishers: reliable, so that a replay that waits for its
    readers sees one that loses nothing.

    :param offers: sequence of ReliabilityPolicy, one a publisher.
    """
    return all(offer == ReliabilityPolicy.RELIABLE for offer in offers)

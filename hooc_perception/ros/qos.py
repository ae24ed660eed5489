# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
The QoS profiles of the table of topics; `qos_overrides` parameters override each of them.

Large best-effort messages get lost when several images are sent at once, so everything that we
publish is reliable. What a late subscriber must know is latched.
"""

from collections.abc import Iterable

from hooc_perception.chain import TOPICS
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSPolicyKind, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions


def qos(topic: str, reliable: bool = True) -> QoSProfile:
    """
    Return the QoSProfile of a topic: keep last, as deep and as latched as its row in TOPICS says.

    :param reliable: False for cameras whose drivers offer best effort only.
    """
    row = TOPICS[topic]
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST, depth=row.depth,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=(DurabilityPolicy.TRANSIENT_LOCAL if row.latched
                    else DurabilityPolicy.VOLATILE))


def overridable(reliability: bool = True) -> QoSOverridingOptions:
    """
    Return the options that declare a topic's QoS as read-only parameters.

    :param reliability: False where a parameter of our own decides on it.
    """
    kinds = [QoSPolicyKind.HISTORY, QoSPolicyKind.DEPTH, QoSPolicyKind.DURABILITY]
    return QoSOverridingOptions(kinds + [QoSPolicyKind.RELIABILITY] if reliability else kinds)


def auto_reliability(offers: Iterable[ReliabilityPolicy]) -> bool:
    """
    Return whether to ask for RELIABLE, given what the publishers of a topic offer.

    Reliable only if every publisher offers it: a reliable reader gets nothing from a
    best-effort writer. Without publishers: reliable, so that a replay that waits for its
    readers sees one that loses nothing.

    :param offers: one policy per publisher.
    """
    return all(offer == ReliabilityPolicy.RELIABLE for offer in offers)

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Parameters that a file or a command line sets and no node has: typing errors, mostly."""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import fields
import difflib
import importlib

from hooc_perception.chain import node_class, NODES, PROFILES, STAGES
from hooc_perception.core.config import Config
from hooc_perception.core.profiles import profile, profiles_with

# Parameters `<kind>.<camera>` of the ingestion node.
_PER_CAMERA = ('extrinsics', 'image_topic', 'info_topic', 'driver')
# Of other kinds, names are only known once the cameras and topics are.
_OPEN = (*_PER_CAMERA, 'mask_image', 'qos_overrides')
_OF_ROS = ('use_sim_time', 'start_type_description_service')


def misaddressed(given: Iterable[str], declared: Iterable[str]) -> list[str]:
    """
    Return one sentence for each parameter that was given and that no node knows.

    Parameters of other nodes may come from a section for all nodes and are passed over.

    :param given: names that files and the command line set for a node.
    :param declared: names that the node has declared.
    """
    unknown = sorted(set(given) - set(declared) - set(_OF_ROS))
    if not unknown:
        return []
    elsewhere = known_elsewhere() | set(declared)
    return [_sentence(name, elsewhere, declared) for name in unknown if name not in elsewhere]


def unknown_parameters(given: Iterable[str]) -> list[str]:
    """
    Return one sentence for each parameter that no node can have, whatever its cameras.

    :param given: names, with dots between their parts.
    """
    known = known_elsewhere() | set(_OF_ROS)
    return [_sentence(name, known, ()) for name in sorted(set(given) - known)
            if name.partition('.')[0] not in _OPEN]


def inert(given: Iterable[str], stages: Mapping[str, Config]) -> list[str]:
    """
    Return one sentence for each given parameter that only the method of another profile has.

    :param given: names that files and the command line set for a node.
    :param stages: {stage: Config} that the node has declared.
    """
    wrong = []
    for name in sorted(given):
        stage, _, parameter = name.partition('.')
        if stage in stages and parameter not in stages[stage].parameters():
            wrong += [f'parameter {name} has no effect here: only the method of profile {other} '
                      'has it; leave it out or set the parameter profile'
                      for other in profiles_with(name)[:1]]
    return wrong


def known_elsewhere() -> set[str]:
    """Return the names of all parameters of all nodes, extrinsics and QoS aside."""
    names: set[str] = set()
    for node in NODES:
        # By name, for this layer lies below the nodes; and only if something is wrong.
        module = importlib.import_module(f'hooc_perception.nodes.{node}')
        names |= {f.name for f in fields(getattr(module, node_class(node)).CONFIG)}
    for name in PROFILES:
        for stage in STAGES:
            names |= {f'{stage}.{p}' for p in profile(name).stage(stage).parameters()}
    return names


def _sentence(name: str, known: Collection[str], declared: Iterable[str]) -> str:
    """Return what is wrong with a name, and what it could have been."""
    kind, _, rest = name.partition('.')
    if kind in _PER_CAMERA:
        cameras = sorted(n.partition('.')[2] for n in declared if n.startswith(f'{kind}.'))
        return (f'parameter {name} is for a camera that is not used; the cameras are '
                f'{", ".join(cameras) or "unknown here: set it for the ingestion_node"}')
    if kind == 'qos_overrides':
        topics = sorted({n.split('.')[1] for n in declared if n.startswith('qos_overrides.')})
        near = difflib.get_close_matches(rest.split('.')[0], topics, 1, 0.5)
        return (f'parameter {name} overrides the QoS of nothing here; it is qos_overrides.<topic '
                'with namespace>.<publisher or subscription>.<history, depth, durability or '
                'reliability>' + (f', such as for {near[0]}' if near else ''))
    near = difflib.get_close_matches(name, known, 1, 0.6)
    return (f'parameter {name} is unknown and has no effect'
            + (f'; is {near[0]} meant?' if near else '; see docs/nodes.md'))

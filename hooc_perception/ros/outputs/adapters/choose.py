# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Which adapters the parameters of a node ask for, and how they are called."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from hooc_perception.core.config import Config, param
from hooc_perception.ros.lifecycle.stage_node import StageNode
from hooc_perception.ros.outputs.adapters.detections import Detections
from hooc_perception.ros.outputs.adapters.guard import is_on, SWITCH
from hooc_perception.ros.outputs.adapters.object_frames import ObjectFrames
from hooc_perception.ros.outputs.adapters.planning_scene import PlanningSceneDiffs
from hooc_perception.ros.outputs.detected import DetectedScene


class Adapter(Protocol):
    """An output in the messages of another package."""

    def publish(self, scene: DetectedScene) -> None:
        """Publish a result."""

    def clear(self, stamp_ns: int, frame: str) -> None:
        """Retract the last result."""


@dataclass(frozen=True)
class AdapterConfig(Config):
    """Parameters of the adapters."""

    publish_tf: str = param('auto', 'Publish a frame `<category>_<id>` per object on /tf; auto = '
                            'where tf2_msgs is installed, which it needs.', choices=SWITCH)
    publish_detections: str = param('auto', 'Publish objects/detections; auto = where '
                                    'vision_msgs is installed, which it needs.', choices=SWITCH)
    planning_scene: str = param('off', 'Keep the objects in the planning scene of MoveIt, as '
                                'their meshes or as their bounding boxes; needs moveit_msgs.',
                                choices=('off', 'mesh', 'box'))
    planning_scene_table: bool = param(
        True, 'Keep the table of scene/table in the planning scene, too, as the object `table`: '
        'a slab under what was seen of it.')
    planning_scene_ttl_s: float = param(
        10.0, 'An object that is missing from the results for this long is removed from the '
        'planning scene; 0 = at once.', 's', 0.0, 3600.0, runtime=True)


def adapters_of(node: StageNode) -> list[Adapter]:
    """
    Return the adapters that the config of a node, an AdapterConfig, asks for.

    :raises HoocError: if the message package of one of them is not installed.
    """
    config, chosen = node.config, []
    if is_on(config.publish_tf, 'tf2_msgs'):
        chosen.append(ObjectFrames(node))
    if is_on(config.publish_detections, 'vision_msgs'):
        chosen.append(Detections(node))
    if config.planning_scene != 'off':
        chosen.append(PlanningSceneDiffs(node, config.planning_scene,
                                         config.planning_scene_table))
    return chosen


def publish_all(node: StageNode, adapters: Sequence[Adapter], scene: DetectedScene) -> None:
    """Publish a result with each adapter; an error of one affects nothing else."""
    for adapter in adapters:
        _guarded(node, adapter, 'publish', lambda a=adapter: a.publish(scene))


def clear_all(node: StageNode, adapters: Sequence[Adapter], stamp_ns: int, frame: str) -> None:
    """Retract the last result with each adapter; an error of one affects nothing else."""
    for adapter in adapters:
        _guarded(node, adapter, 'clear', lambda a=adapter: a.clear(stamp_ns, frame))


def _guarded(node: StageNode, adapter: Adapter, what: str, call: Callable[[], None]) -> None:
    """Report in /diagnostics whether a call went well, under the name of the adapter."""
    name = type(adapter).__name__
    if node.guarded(call, name, f'its {what} is skipped')():
        node.diagnostics.ok(name)

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Which adapters a node's parameters ask for."""

from dataclasses import dataclass

from hooc_perception.core.config import Config, param
from hooc_perception.ros.outputs.adapters.detections import Detections
from hooc_perception.ros.outputs.adapters.object_frames import ObjectFrames
from hooc_perception.ros.outputs.adapters.planning_scene import PlanningSceneDiffs


@dataclass(frozen=True)
class AdapterConfig(Config):
    """Parameters of the adapters; all are off by default."""

    publish_tf: bool = param(False, 'Send a frame `<category>_<id>` of every object on /tf; needs '
                             'tf2_msgs.')
    publish_detections: bool = param(False, 'Publish objects/detections; needs vision_msgs.')
    planning_scene: str = param('off', 'Keep the objects in the planning scene of MoveIt, as '
                                'their meshes or as boxes around them; needs moveit_msgs.',
                                choices=('off', 'mesh', 'box'))
    planning_scene_ttl_s: float = param(
        10.0, 'An object that no answer has shown for so long is taken out of the planning '
        'scene; 0: as soon as an answer does not show it.', 's', 0.0, 3600.0, runtime=True)


def adapters_of(node):
    """
    Return the adapters that the config of a StageNode asks for.

    :raises HoocError: where one is asked for whose message package is not installed.
    """
    config, chosen = node.config, []
    if config.publish_tf:
        chosen.append(ObjectFrames(node))
    if config.publish_detections:
        chosen.append(Detections(node))
    if config.planning_scene != 'off':
        chosen.append(PlanningSceneDiffs(node, config.planning_scene))
    return chosen


def tell(node, adapters, what, *args):
    """
    Have adapters `publish` or `clear`; what fails costs neither the other ones nor the answer.

    :param what: name of the method; `args` go to it.
    """
    for adapter in adapters:
        thing = type(adapter).__name__
        if node.guarded(getattr(adapter, what), thing, f'its {what} is left out')(*args):
            node.diagnostics.ok(thing)

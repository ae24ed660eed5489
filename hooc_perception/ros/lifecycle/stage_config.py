# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The parameters that every node has."""

from dataclasses import dataclass

from hooc_perception.chain import PROFILES
from hooc_perception.core.config import Config, param
from hooc_perception.ros.lifecycle.parameters import fixed_param


@dataclass(frozen=True)
class NodeConfig(Config):
    """Parameters of every node."""

    autostart: bool = fixed_param(
        False, 'Configure and activate by itself after the start, also after a restart; for '
        'launch files and `ros2 run`.')
    wait_for_stages: bool = param(
        False, 'Activating waits up to 30 s until the nodes that need the topics of this one have '
        'subscribed; with autostart, for as long as it takes until they are active. For '
        'recordings, which publish every frame set only once.')


@dataclass(frozen=True)
class StageConfig(NodeConfig):
    """Parameters of every node of the chain."""

    model: str = param('', 'Folder that `hooc train` wrote.')
    profile: str = fixed_param(
        '', 'The method: paper, best or fast; empty = the one that the model was trained for. '
        'It sets the defaults of the stage parameters.', choices=('', *PROFILES))
    cameras: tuple[str, ...] = param(
        (), 'Camera names, in the same order in every node; empty = those of the model.')
    target_frame: str = param('table', 'Frame of all results: z up, z = 0 is the table top.')
    seed: int = param(0, 'Seed of all random choices; every stage derives its own from it.',
                      '', 0, 2 ** 31 - 1)
    incremental: bool = param(
        True, 'What has not changed since the last frame set is not decided anew (docs/live.md). '
        'Give all nodes the same value; false = every frame set by itself.', runtime=True)
    warm_up: bool = param(True, 'Run the stage on a synthetic scene while configuring, so that '
                          'the first result does not wait for compiled code.')

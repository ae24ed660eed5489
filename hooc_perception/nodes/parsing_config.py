# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Parameters of the parsing node."""

from dataclasses import dataclass

from hooc_perception.core.config import param
from hooc_perception.core.parsing.tracking import TrackConfig
from hooc_perception.nodes.following import FollowConfig
from hooc_perception.ros.lifecycle.stage_config import StageConfig
from hooc_perception.ros.outputs.adapters.choose import AdapterConfig


@dataclass(frozen=True)
class ParsingConfig(FollowConfig, AdapterConfig, TrackConfig, StageConfig):
    """Parameters of the parsing node."""

    max_instances: int = param(-1, 'Maximum number of objects per category in a scene; 0 = no '
                               'limit, -1 = the limit of the model.', '', -1, 1000)
    sigmas: bool = param(True, 'Estimate sigma_t and sigma_r, at about 0.05 CPU seconds per '
                         'object.', runtime=True)
    keep_answer_s: float = param(0.0, 'A result is retracted after this time without a '
                                 'successor, as by `reset`; 0 = never.', 's', 0.0, 86400.0,
                                 runtime=True)
    detect_timeout_s: float = param(30.0, 'The detect service gives up after this time.', 's',
                                    0.1, 600.0, runtime=True)

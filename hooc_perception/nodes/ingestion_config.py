# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The parameters of the ingestion node."""

from dataclasses import dataclass

from hooc_perception.core.config import param
from hooc_perception.io.frame_sets import FrameSetConfig
from hooc_perception.nodes.robot_config import RobotConfig
from hooc_perception.ros.inputs.camera_input import CameraInputConfig


@dataclass(frozen=True)
class IngestionConfig(FrameSetConfig, RobotConfig, CameraInputConfig):
    """Parameters of the ingestion node."""

    wait_for_answer_s: float = param(
        20.0, 'While objects/poses has a publisher, the next frame set is sent when the last one '
        'has been answered, so that the chain always works on the newest images; after this '
        'time it is sent in any case. 0 = never wait.', 's', 0.0, 600.0, runtime=True)
    fuse_frames: int = param(
        1, 'Temporal median over this many frames of each camera, against noise in static '
        'scenes; an odd number is best. Starts again where the depth changes. 1 = off.',
        '', 1, 30, runtime=True)
    explain_after_s: float = param(
        3.0, 'A camera that has been silent for this time is diagnosed, and again while it stays '
        'silent; 0 = never.', 's', 0.0, 3600.0, runtime=True)
    check_extrinsics_s: float = param(
        30.0, 'Time between two checks whether the cameras agree about the surfaces that two of '
        'them see; a check takes a few tenths of a second. 0 = never.', 's', 0.0, 3600.0,
        runtime=True)

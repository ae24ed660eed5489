# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
A small synthetic scene, on which a node tries its stage while it is configured.

Compiled code is loaded (the first time ever: compiled) at the first call, which would delay the
first real result; and a model that does not fit is noticed before it is needed.
"""

from collections.abc import Callable, Sequence
import time
from typing import Any

from hooc_perception.core.geometry import inverse, posed_vertices, rays
from hooc_perception.core.render import render_depth
from hooc_perception.core.segment.observe import observe
from hooc_perception.core.types import (
    Camera,
    Candidates,
    GenericModel,
    Observation,
    PixelProbabilities,
    RectifiedView,
)
from hooc_perception.ros.lifecycle.stage_config import StageConfig
from hooc_perception.ros.lifecycle.stage_node import StageNode
from hooc_perception.trained.folder import ModelFolder
import numpy as np

MOST_MODELS = 3


Stage = Callable[[Observation, PixelProbabilities, Candidates, tuple[GenericModel, ...]], object]


def warmed(node: StageNode[StageConfig, Any], model: ModelFolder, stage: Stage) -> None:
    """Call a stage on the synthetic scene and time it, if the parameter warm_up is true."""
    if not node.config.warm_up:
        return
    start = time.monotonic()
    views, probabilities, candidates, models = made_up_scene(model.models, model.cameras)
    stage(observe(views), probabilities, candidates, models)
    node.diagnostics.ok('warm_up', seconds=time.monotonic() - start)


def made_up_scene(models: Sequence[GenericModel], cameras: Sequence[Camera]) -> tuple[
        tuple[RectifiedView, ...], PixelProbabilities, Candidates, tuple[GenericModel, ...]]:
    """
    Return (views, probabilities, candidates, models) of the first few models on a table.

    :param cameras: with poses; if there are none, an overhead camera takes their place.
    :return: the views, the true probabilities and candidates, and the models; class ids count
        from 1.
    """
    models = tuple(models[:MOST_MODELS])
    n = len(models)
    angle = np.arange(n) * 2 * np.pi / n
    translation = np.stack([0.15 * np.cos(angle), 0.15 * np.sin(angle),
                            [model.extents[2] / 2 for model in models]], -1)
    candidates = Candidates(
        np.arange(1, n + 1, dtype=np.uint16), translation, np.tile([0.0, 0.0, 0.0, 1.0], (n, 1)),
        np.array([model.extents for model in models], np.float32), np.ones(n, np.float32))
    meshes = [(posed_vertices(model, translation[i], [0, 0, 0, 1], model.extents), model.faces)
              for i, model in enumerate(models)]
    views, camera_index, uv, ids = [], [], [], []
    for i, camera in enumerate(cameras or (overhead_camera(),)):
        T_camera_world = inverse(camera.T_world_camera)
        directions = rays(camera.K, camera.height, camera.width) @ T_camera_world[:3, :3]
        with np.errstate(divide='ignore'):
            table = -camera.T_world_camera[2, 3] / directions[..., 2]
        table[table <= 0] = np.inf
        depth, seen = render_depth(meshes, camera)
        depth = np.minimum(depth, table.astype(np.float32))
        depth[~np.isfinite(depth)] = np.nan
        views.append(RectifiedView(camera, depth))
        rows, columns = np.nonzero(seen >= 0)
        camera_index.append(np.full(len(rows), i, np.uint8))
        uv.append(np.stack([columns, rows], -1).astype(np.uint16))
        ids.append(seen[rows, columns] + 1)
    p = np.where(np.concatenate(ids)[:, None] == np.arange(n + 1), 235, 20 // n).astype(np.uint8)
    return (tuple(views), PixelProbabilities(np.concatenate(camera_index), np.concatenate(uv), p),
            candidates, models)


def overhead_camera() -> Camera:
    """Return a small camera that looks straight down from 1 m."""
    return Camera('overhead', 160, 120, np.array([[150.0, 0, 79.5], [0, 150, 59.5], [0, 0, 1]]),
                  np.zeros(5), np.array([[1.0, 0, 0, 0], [0, -1, 0, 0], [0, 0, -1, 1],
                                         [0, 0, 0, 1]]))

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
A small made-up scene, on which a node tries its stage while it is configured.

Compiled code is loaded (the first time ever: compiled) at the first call, which would make the
first real answer late, and a model that does not fit is found out before it is needed.
"""

import time

from hooc_perception.core.geometry import inverse, posed_vertices, rays
from hooc_perception.core.render import render_depth
from hooc_perception.core.types import Camera, Candidates, PixelProbabilities, RectifiedView
import numpy as np

MOST_MODELS = 3


def warmed(node, model, stage):
    """
    Call `stage(views, probabilities, candidates, models)` on the made-up scene; time it.

    Not where the node's parameter warm_up is false.
    """
    if not node.config.warm_up:
        return
    start = time.monotonic()
    stage(*made_up_scene(model.models, model.cameras))
    node.diagnostics.ok('warm_up', seconds=time.monotonic() - start)


def made_up_scene(models, cameras):
    """
    Return (views, probabilities, candidates, models) of the first few models on a table.

    :param cameras: sequence of Camera with poses; an overhead one stands in for none.
    :return: tuple of RectifiedView, the true PixelProbabilities and Candidates, and the
        models, whose class ids count from 1.
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


def overhead_camera():
    """Return a small camera that looks straight down from 1 m."""
    return Camera('overhead', 160, 120, np.array([[150.0, 0, 79.5], [0, 150, 59.5], [0, 0, 1]]),
                  np.zeros(5), np.array([[1.0, 0, 0, 0], [0, -1, 0, 0], [0, 0, -1, 1],
                                         [0, 0, 0, 1]]))

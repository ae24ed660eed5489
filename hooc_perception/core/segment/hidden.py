# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Self-filtering: pixels of a raw depth image that show the robot are set aside before stage 1.

The robot's padded links are rendered into the camera. What is measured at or behind them is the
robot or nothing at all: these pixels become `hidden`. What is measured in front of them stays.
"""

from collections.abc import Sequence
from dataclasses import replace

from hooc_perception.core.arrays import BoolArray, Float32Array, Float64Array, Int32Array
from hooc_perception.core.geometry import inverse, transform
from hooc_perception.core.render import render_depth
from hooc_perception.core.segment.config import ObserveConfig
from hooc_perception.core.segment.rectify import raw_pixels, rectify
from hooc_perception.core.types import Camera, DepthView, Observation
import numpy as np
from scipy.ndimage import minimum_filter

# (vertices (V, 3) float64 metres, faces (F, 3) int32)
Mesh = tuple[Float64Array, Int32Array]
# Depth cameras measure nothing nearer than this, and the housing of a camera that the URDF
# models would otherwise hide everything from its own lens.
NEAREST_M = 0.1


def robot_depth(meshes: Sequence[Mesh], camera: Camera, padding_px: int = 0) -> Float32Array:
    """
    Render the robot into a rectified camera.

    :param meshes: the links, padded already, world frame. Their parts that are nearer than
        NEAREST_M along the optical axis are cut off.
    :param padding_px: its outline grows by this many pixels.
    :return: (H, W) float32 metres, inf where the robot is not.
    """
    depth, _ = render_depth([_cut_near(mesh, camera) for mesh in meshes], camera)
    if padding_px:
        minimum_filter(depth.copy(), 2 * padding_px + 1, output=depth)
    return depth


def without_robot(view: DepthView, meshes: Sequence[Mesh], padding_px: int = 0,
                  config: ObserveConfig = ObserveConfig()) -> DepthView:
    """
    Return a raw view whose pixels on or behind the robot have no reading and are `hidden`.

    :param meshes: (vertices, faces) of the links in the world frame, padded already, see
        hooc_perception.robot.
    :param padding_px: the outline of the robot grows by this many pixels of the rectified image.
    :return: the same view where the robot is not in sight.
    """
    flat = rectify(view, config)
    robot = robot_depth(meshes, flat.camera, padding_px)
    # No reading is hidden, too: dark and grazing surfaces often give none.
    behind = np.isfinite(robot) & ~(flat.depth < robot)
    if not behind.any():
        return view
    hidden = np.zeros(view.depth.size, bool)
    source = raw_pixels(view.camera)[behind]
    hidden[source[source >= 0]] = True
    return with_hidden(view, hidden.reshape(view.depth.shape))


def with_hidden(view: DepthView, hidden: BoolArray) -> DepthView:
    """Return a raw view in which the pixels of a mask (H, W) are hidden as well."""
    hidden = hidden if view.hidden is None else hidden | view.hidden
    return replace(view, depth=np.where(hidden, np.float32(np.nan), view.depth), hidden=hidden)


def hidden_shares(observation: Observation) -> list[float]:
    """Return the share of the table's pixels that the robot hides, per view; NaN = no table."""
    shares = []
    for view in observation.views:
        if not view.table.any():
            shares.append(float('nan'))
        else:
            shares.append(0.0 if view.hidden is None else float(view.hidden[view.table].mean()))
    return shares


def _cut_near(mesh: Mesh, camera: Camera) -> Mesh:
    """Return the part of a mesh that is farther from the image plane than NEAREST_M."""
    vertices, faces = mesh
    z = transform(inverse(camera.T_world_camera), vertices)[:, 2]
    far = z > NEAREST_M
    count = far[faces].sum(1)
    if (count == 3).all():
        return mesh
    kept, extra, total = [faces[count == 3]], [], len(vertices)
    for inside in (1, 2):
        cut = faces[count == inside]
        # The vertex on the side of its own comes first.
        odd = far[cut] == (inside == 1)
        a, b, c = np.take_along_axis(cut, (odd.argmax(1)[:, None] + [0, 1, 2]) % 3, 1).T
        ab, ac = total + np.arange(len(a)), total + len(a) + np.arange(len(a))
        for other in (b, c):
            t = ((z[a] - NEAREST_M) / (z[a] - z[other]))[:, None]
            extra.append(vertices[a] + t * (vertices[other] - vertices[a]))
        total += 2 * len(a)
        new = [(a, ab, ac)] if inside == 1 else [(ab, b, c), (ab, c, ac)]
        kept += [np.stack(triangle, 1) for triangle in new]
    return (np.concatenate([vertices, *extra]),
            np.concatenate(kept).astype(np.int32))

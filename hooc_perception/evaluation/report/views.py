# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The pictures of each view: depth, classes and residuals with outlines; shaded pictures."""

from collections.abc import Sequence
from typing import Any

from hooc_perception.core.arrays import AnyArray, BoolArray, Int32Array
from hooc_perception.core.geometry import back_project
from hooc_perception.core.render import render_depth
from hooc_perception.core.types import Camera, ObservedView, PixelProbabilities
from hooc_perception.evaluation.matching import PosedObject
from hooc_perception.evaluation.report import pictures
from hooc_perception.evaluation.report.pictures import Palette
from hooc_perception.evaluation.report.scene import ShownScene
from hooc_perception.evaluation.report.shaded import shaded_picture
import numpy as np

MARGIN = 0.03
REACH_M = 0.5


def view_pictures(shown: ShownScene, j: int, palette: Palette) -> dict[str, Any]:
    """Return the pictures of one view, as the template takes them."""
    scene = shown.scene
    view = scene.observation.views[j]
    camera = view.camera
    depth, ids = render_depth(shown.meshes, camera)
    true_ids = render_depth(shown.true_meshes, camera)[1]
    explained = np.fmin(np.where(np.isfinite(depth), depth, np.nan), view.background)
    near = _objects(view) if view.foreground.any() else view.foreground
    rows, columns = window(near | (ids >= 0) | (true_ids >= 0), camera)
    near = view.depth[rows, columns]
    near = near[np.isfinite(near)]
    low, high = np.percentile(near, [1, 97]) if len(near) else (0.0, 1.0)
    layers = [('measured', 'measured depth',
               pictures.depth_picture(view.depth, camera, low, high)),
              ('explained', 'rendered depth',
               pictures.depth_picture(explained, camera, low, high)),
              ('residual', 'residual', pictures.residual_picture(view.depth, explained))]
    if scene.probabilities is not None:
        classes = most_likely(scene.probabilities, j, view.depth.shape)
        shade = pictures.hillshade(view.depth, camera)
        layers.insert(1, ('labels', 'most likely class', pictures.class_picture(
            shade, classes, scene.class_names, palette)))
    crop = (slice(None), slice(None)) if not len(near) else (rows, columns)
    height, width = view.depth[crop].shape
    return {'camera': camera.name, 'width': width, 'height': height, 'font': width / 34,
            'layers': [{'key': key, 'title': title, 'uri': pictures.data_uri(rgb[crop])}
                       for key, title, rgb in layers],
            'outlines': _outlines(ids[crop], shown.drawn, palette, width / 34),
            'truth': _outlines(true_ids[crop], shown.true, palette, width / 34)}


def _objects(view: ObservedView) -> BoolArray:
    """Return (H, W) bool: the foreground near its middle; what is farther away is clutter."""
    points = back_project(view.depth, view.camera)[..., :2]
    middle = np.median(points[view.foreground], axis=0)
    with np.errstate(invalid='ignore'):
        return view.foreground & (np.linalg.norm(points - middle, axis=-1) < REACH_M)


def window(mask: BoolArray, camera: Camera) -> tuple[slice, slice]:
    """Return (rows, columns) slices around a mask, with a margin, shaped like the image."""
    rows, columns = np.flatnonzero(mask.any(1)), np.flatnonzero(mask.any(0))
    if not len(rows):
        return slice(0, camera.height), slice(0, camera.width)
    pad = MARGIN * camera.width
    width = columns[-1] - columns[0] + 1 + 2 * pad
    height = rows[-1] - rows[0] + 1 + 2 * pad
    scale = max(width / camera.width, height / camera.height)

    def part(ends: AnyArray, size: int) -> slice:
        length = min(size, int(np.ceil(size * scale)))
        start = int(np.clip((ends[0] + ends[-1] - length) / 2, 0, size - length))
        return slice(start, start + length)

    return part(rows, camera.height), part(columns, camera.width)


def most_likely(probabilities: PixelProbabilities, view: int,
                shape: tuple[int, int]) -> Int32Array:
    """Return (H, W) int32, the most likely class of every pixel of one view; 0 background."""
    classes = np.zeros(shape, np.int32)
    mine = probabilities.camera == view
    u, v = probabilities.uv[mine].astype(int).T
    classes[v, u] = probabilities.p[mine].argmax(1)
    return classes


def _outlines(ids: AnyArray, objects: Sequence[PosedObject], palette: Palette,
              font: float) -> list[dict[str, Any]]:
    """Return the outlines of all visible objects, with places for names that do not overlap."""
    colours = pictures.instance_colours(objects, palette)
    out: list[dict[str, Any]] = []
    for k, thing in enumerate(objects):
        shape = pictures.outline(ids == k)
        if shape:
            path, (x, y), _ = shape
            out.append({'k': k, 'path': path, 'x': x, 'y': y, 'name': thing.category,
                        'colour': pictures.hex_colour(colours[k])})
    placed: list[tuple[float, float, float]] = []
    for item in sorted(out, key=lambda o: o['y']):
        half = 0.29 * font * len(item['name']) + 1
        item['x'] = float(np.clip(item['x'], half, max(half, ids.shape[1] - half)))
        y = max(item['y'], font)
        while any(abs(item['x'] - x) < half + h and abs(y - other) < 1.05 * font
                  for x, other, h in placed):
            y += 0.3 * font
        item['y'] = round(min(y, ids.shape[0] - 0.3 * font), 1)
        item['x'] = round(item['x'], 1)
        placed.append((item['x'], y, half))
    return out


def shaded_pictures(shown: ShownScene, palette: Palette) -> list[dict[str, Any]]:
    """Return the shaded pictures: the estimate and, where it is known, the truth."""
    camera = shown.scene.observation.views[0].camera
    out = []
    for title, objects, shapes in (('estimate', shown.drawn, shown.meshes),
                                   ('truth', shown.true, shown.true_meshes)):
        if title == 'truth' and shown.scene.truth is None:
            continue
        rgb = shaded_picture(shapes, pictures.instance_colours(objects, palette), camera,
                             shown.meshes + shown.true_meshes)
        out.append({'title': title, 'uri': pictures.data_uri(rgb), 'height': rgb.shape[0],
                    'width': rgb.shape[1]})
    return out

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Pictures of depth, classes and residuals as small PNGs, and outlines as SVG paths."""

import base64
from collections.abc import Iterable, Mapping, Sequence
import colorsys
import io
from typing import TypeAlias

import cv2
from hooc_perception.core.arrays import AnyArray, BoolArray, Float64Array, UInt8Array
from hooc_perception.core.geometry import back_project
from hooc_perception.core.types import Camera
from hooc_perception.evaluation.matching import PosedObject
from matplotlib import colormaps
import numpy as np
from PIL import Image

# Red, green and blue, 0..255.
RGB: TypeAlias = tuple[int, int, int]
Palette: TypeAlias = Mapping[str, RGB]

NOTHING = (38, 42, 51)
RESIDUAL_M = 0.06


def colours(names: Iterable[str]) -> dict[str, RGB]:
    """Return {name: (r, g, b) 0..255}, distinct hues in the order of the sorted names."""
    out: dict[str, RGB] = {}
    for i, name in enumerate(sorted(names)):
        # Steps of the golden angle keep alphabetical neighbours far apart in hue.
        hue = (0.02 + i * 0.381966) % 1.0
        light, strong = ((0.62, 0.80), (0.52, 0.62), (0.72, 0.70))[i % 3]
        red, green, blue = colorsys.hls_to_rgb(hue, light, strong)
        out[name] = int(255 * red), int(255 * green), int(255 * blue)
    return out


def instance_colours(objects: Sequence[PosedObject], palette: Palette) -> list[RGB]:
    """
    Return one (r, g, b) per object: that of its category, varied for further instances.

    Instances with ids are varied in the order of their ids, so that they keep their colours while
    they stay.
    """
    out: list[RGB] = [(0, 0, 0)] * len(objects)
    count: dict[str, int] = {}
    for i in sorted(range(len(objects)), key=lambda i: objects[i].id or 0):
        thing = objects[i]
        k = count[thing.category] = count.get(thing.category, -1) + 1
        rgb = np.array(palette[thing.category])
        red, green, blue = (rgb * (1, 0.7)[k % 2] + 70 * (k % 3 == 2)).clip(0, 255).astype(int)
        out[i] = int(red), int(green), int(blue)
    return out


def hex_colour(rgb: Iterable[float]) -> str:
    """Return '#rrggbb'."""
    return '#' + ''.join(f'{int(c):02x}' for c in rgb)


def data_uri(rgb: UInt8Array) -> str:
    """Return a data: URI of an (h, w, 3) uint8 image as a PNG of at most 256 colours."""
    image = Image.fromarray(np.ascontiguousarray(rgb)).quantize(
        256, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
    stream = io.BytesIO()
    image.save(stream, 'PNG', optimize=True)
    return 'data:image/png;base64,' + base64.b64encode(stream.getvalue()).decode()


def hillshade(depth: AnyArray, camera: Camera, sigma: float = 1.2) -> Float64Array:
    """
    Return (H, W) float 0..1: the shading of a surface of this depth by a lamp near the camera.

    :param depth: (H, W) float, NaN or inf = none; smoothed over `sigma` pixels first.
    """
    known = np.isfinite(depth)
    filled = np.where(known, depth, 0).astype(np.float32)
    weight = known.astype(np.float32)
    if sigma:
        filled = cv2.GaussianBlur(filled, (0, 0), sigma)
        weight = cv2.GaussianBlur(weight, (0, 0), sigma)
    with np.errstate(invalid='ignore', divide='ignore'):
        smooth = np.where(known, filled / weight, np.nan)
    points = back_project(smooth, camera)
    normals = np.cross(np.gradient(points, axis=1), np.gradient(points, axis=0))
    eye = camera.T_world_camera[:3, 3]
    lamp = eye + 0.5 * camera.T_world_camera[:3, 0] - 0.8 * camera.T_world_camera[:3, 1]
    ray = lamp - points
    with np.errstate(invalid='ignore', divide='ignore'):
        cosine = (np.einsum('ijk,ijk->ij', normals, ray)
                  / np.linalg.norm(normals, axis=-1) / np.linalg.norm(ray, axis=-1))
    return np.nan_to_num(np.abs(cosine), nan=0.6)


def depth_picture(depth: AnyArray, camera: Camera, low: float, high: float) -> UInt8Array:
    """Return (H, W, 3) uint8: colour by depth between `low` and `high` metres, shaded."""
    known = np.isfinite(depth)
    share = np.clip((np.where(known, depth, low) - low) / max(high - low, 1e-3), 0, 1)
    # A muted colour map, so that the outlines stand out.
    rgb = colormaps['bone'](0.9 - 0.6 * share)[..., :3] * 255
    rgb *= (0.3 + 0.8 * hillshade(depth, camera) ** 1.5)[..., None]
    rgb[~known] = NOTHING
    return np.clip(rgb, 0, 255).astype(np.uint8)


def class_picture(shade: Float64Array, classes: AnyArray, names: Sequence[str],
                  palette: Palette) -> UInt8Array:
    """Return (H, W, 3) uint8: class ids (H, W) in colour, 0 = background, on a grey shade."""
    grey = 60 + 120 * np.repeat(shade[..., None], 3, -1)
    table = np.array([(0, 0, 0)] + [palette[name] for name in names], np.float64)
    coloured = table[classes] * (0.55 + 0.45 * shade[..., None])
    return np.where((classes > 0)[..., None], coloured, grey).clip(0, 255).astype(np.uint8)


def residual_picture(measured: AnyArray, explained: AnyArray) -> UInt8Array:
    """
    Return (H, W, 3) uint8: measured minus rendered depth, up to RESIDUAL_M in both directions.

    Red: the measured surface is nearer than the rendered one (something is not explained);
    blue: farther (an object violates free space).
    """
    known = np.isfinite(measured) & np.isfinite(explained)
    gap = np.where(known, explained - np.where(known, measured, 0), 0)
    rgb = colormaps['RdBu_r'](np.clip(gap / (2 * RESIDUAL_M) + 0.5, 0, 1))[..., :3] * 255
    rgb[~known] = NOTHING
    return rgb.astype(np.uint8)


def outline(mask: BoolArray,
            scale: float = 1.0) -> tuple[str, tuple[float, float], int] | None:
    """
    Return (SVG path, (x, y) of the label, area) of a (H, W) bool mask; None where it is empty.

    Pixel (0, 0) covers the unit square at the origin of the path's coordinates.
    """
    contours, _ = cv2.findContours(mask.astype(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    parts = []
    for contour in contours:
        if len(contour) < 3:
            continue
        corner = cv2.approxPolyDP(contour, 0.7, True)[:, 0] + 0.5
        if len(corner) > 2:
            parts.append('M' + 'L'.join(f'{x * scale:.4g} {y * scale:.4g}' for x, y in corner)
                         + 'Z')
    if not parts:
        return None
    # The name goes to the innermost point of the mask, which is on the object whatever its shape.
    inner = cv2.distanceTransform(np.pad(mask, 1).astype(np.uint8), cv2.DIST_L2, 5)[1:-1, 1:-1]
    y, x = np.unravel_index(int(inner.argmax()), inner.shape)
    return ''.join(parts), ((x + 0.5) * scale, (y + 0.5) * scale), int(mask.sum())

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Shaded pictures of meshes, for reports and documentation only.

pyrender draws them off screen by EGL or OSMesa, whichever is installed. Without either, the
package's own depth renderer draws them, with the shading computed from the depth.
"""

import atexit
from collections.abc import Sequence
import ctypes.util
from dataclasses import dataclass
import functools
import logging
import os
from typing import Any

from hooc_perception.core.arrays import AnyArray, Float64Array, UInt8Array
from hooc_perception.core.geometry import back_project, inverse, project, transform
from hooc_perception.core.render import render_depth
from hooc_perception.core.types import Camera
import numpy as np
import trimesh

log = logging.getLogger(__name__)

GREY = (150, 156, 164)
SMOOTH_BELOW_DEG = 25.0
# The numpy fallback draws this many times larger and averages.
OVERSAMPLE = 2

# Vertices (V, 3) in world metres and faces (F, 3).
_Mesh = tuple[AnyArray, AnyArray]
_Colour = tuple[int, int, int]


@dataclass(frozen=True)
class Orbit:
    """
    A viewpoint on a circle around the meshes that fits them into the picture.

    :ivar azimuth_deg: of the viewer, from x towards y.
    :ivar elevation_deg: of the viewer above the horizontal.
    :ivar fill: share of the picture's width or height that the meshes take.
    """

    azimuth_deg: float = -55.0
    elevation_deg: float = 35.0
    fill: float = 0.88

    def camera(self, vertices: Float64Array, size: tuple[int, int]) -> Camera:
        """Return the Camera that sees all vertices (V, 3) in a picture of size (width, height)."""
        low, high = np.min(vertices, axis=0), np.max(vertices, axis=0)
        a, e = np.radians(self.azimuth_deg), np.radians(self.elevation_deg)
        back = np.array([np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)])
        right = np.array([-np.sin(a), np.cos(a), 0.0])
        T_world_camera = np.eye(4)
        T_world_camera[:3, :3] = np.column_stack([right, np.cross(-back, right), -back])
        # Far enough for little perspective distortion; the focal length then fits the meshes.
        distance = 2.5 * max(np.linalg.norm(high - low), 0.05)
        T_world_camera[:3, 3] = (low + high) / 2 + distance * back
        u, v = project(np.eye(3), transform(inverse(T_world_camera), vertices))
        width, height = size
        focal = self.fill * min(width / max(np.ptp(u), 1e-6), height / max(np.ptp(v), 1e-6))
        K = np.array([[focal, 0, (width - 1) / 2 - focal * (u.min() + u.max()) / 2],
                      [0, focal, (height - 1) / 2 - focal * (v.min() + v.max()) / 2],
                      [0, 0, 1.0]])
        return Camera('orbit', width, height, K, np.zeros(5), T_world_camera)


def render_shaded(meshes: Sequence[trimesh.Trimesh | _Mesh], view: Camera | Orbit | None = None,
                  size: tuple[int, int] = (320, 240), colours: Sequence[_Colour] | None = None,
                  background: _Colour = (255, 255, 255)) -> UInt8Array:
    """
    Return a shaded picture (H, W, 3) uint8 of posed meshes.

    :param meshes: trimesh.Trimesh or (vertices (V, 3) world metres, faces (F, 3)).
    :param view: a rectified Camera, whose image size is used, or an Orbit.
    :param size: (width, height) in pixels, for an Orbit.
    :param colours: one (r, g, b) 0..255 per mesh; None = grey.
    """
    pairs = [(np.asarray(m.vertices, np.float64), np.asarray(m.faces, np.int32))
             if isinstance(m, trimesh.Trimesh) else m for m in meshes]
    colours = [GREY] * len(pairs) if colours is None else list(colours)
    if not isinstance(view, Camera):
        view = (view or Orbit()).camera(
            np.vstack([v for v, _ in pairs] or [np.zeros((1, 3))]), size)
    if _pyrender() is not None:
        try:
            return _by_pyrender(pairs, view, colours, background)
        except Exception as e:  # a driver may fail in any way; numpy still gives a picture
            log.warning('pyrender failed (%s); shading with numpy instead', e)
            _pyrender.cache_clear()
            os.environ['HOOC_NO_GL'] = '1'
    return _by_numpy(pairs, view, colours, background)


@functools.lru_cache(maxsize=1)
def _pyrender() -> Any:
    """Return the module pyrender, set up for an installed OpenGL platform, or None."""
    if os.environ.get('HOOC_NO_GL'):
        return None
    if 'PYOPENGL_PLATFORM' not in os.environ:
        found = [name for name, library in (('egl', 'EGL'), ('osmesa', 'OSMesa'))
                 if ctypes.util.find_library(library)]
        if not found:
            return None
        os.environ['PYOPENGL_PLATFORM'] = found[0]
    # pyrender 0.1.45 uses np.infty, which numpy 2 has removed.
    if not hasattr(np, 'infty'):
        setattr(np, 'infty', np.inf)
    try:
        import pyrender
    except Exception as e:
        log.warning('pyrender cannot be used (%s); shading with numpy instead', e)
        return None
    return pyrender


@functools.lru_cache(maxsize=1)
def _renderer() -> Any:
    """Return the off-screen renderer of this process; its size is set before each use."""
    renderer = _pyrender().OffscreenRenderer(64, 64)
    atexit.register(renderer.delete)
    return renderer


def _by_pyrender(pairs: Sequence[_Mesh], camera: Camera, colours: Sequence[_Colour],
                 background: _Colour) -> UInt8Array:
    """Draw by OpenGL."""
    pyrender = _pyrender()
    scene = pyrender.Scene(bg_color=[*np.divide(background, 255.0), 1.0],
                           ambient_light=[0.22, 0.22, 0.22])
    for (vertices, faces), colour in zip(pairs, colours):
        mesh = trimesh.graph.smooth_shade(trimesh.Trimesh(vertices, faces, process=False),
                                          angle=np.radians(SMOOTH_BELOW_DEG), facet_minarea=None)
        # pyrender expects linear light; the colours of a picture are gamma encoded.
        material = pyrender.MetallicRoughnessMaterial(
            baseColorFactor=[*np.divide(colour, 255.0) ** 2.2, 1.0], metallicFactor=0.0,
            roughnessFactor=0.8, doubleSided=True)
        scene.add(pyrender.Mesh.from_trimesh(mesh, material=material, smooth=True))
    # OpenGL cameras look along -z with y up, and pixel centres lie at halves.
    T_world_gl = camera.T_world_camera @ np.diag([1.0, -1.0, -1.0, 1.0])
    K = camera.K
    scene.add(pyrender.IntrinsicsCamera(K[0, 0], K[1, 1], K[0, 2] + 0.5, K[1, 2] + 0.5,
                                        znear=0.02, zfar=50.0), pose=T_world_gl)
    key = np.eye(4)
    key[:3, :3] = T_world_gl[:3, :3] @ trimesh.transformations.euler_matrix(-0.7, -0.6, 0)[:3, :3]
    scene.add(pyrender.DirectionalLight(intensity=2.3), pose=key)
    scene.add(pyrender.DirectionalLight(intensity=0.9), pose=T_world_gl)
    renderer = _renderer()
    renderer.viewport_width, renderer.viewport_height = camera.width, camera.height
    return np.array(renderer.render(scene)[0], np.uint8)


def _by_numpy(pairs: Sequence[_Mesh], camera: Camera, colours: Sequence[_Colour],
              background: _Colour) -> UInt8Array:
    """Draw with the depth renderer; the shading follows from the slope of the depth."""
    n = OVERSAMPLE
    K = camera.K * n
    K[:2, 2] += (n - 1) / 2
    K[2, 2] = 1.0
    large = Camera(camera.name, camera.width * n, camera.height * n, K, np.zeros(5),
                   camera.T_world_camera)
    depth, ids = render_depth(pairs, large)
    points = back_project(np.where(np.isfinite(depth), depth, np.nan), large)
    normal = np.cross(np.gradient(points, axis=1), np.gradient(points, axis=0))
    # Beside an empty pixel there is no slope; such a pixel faces the viewer.
    back = -camera.T_world_camera[:3, 2]
    normal = np.where(np.isfinite(normal).all(-1, keepdims=True), normal, back)
    normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-12)
    T = camera.T_world_camera
    key = T[:3, :3] @ np.array([-0.50, -0.60, -0.62])
    light = 0.35 + 0.45 * np.abs(normal @ key) + 0.25 * np.abs(normal @ back)
    picture = np.array([*colours, background], np.float64)[ids]
    picture = np.where(ids[..., None] >= 0, picture * light[..., None], picture)
    small = picture.reshape(camera.height, n, camera.width, n, 3).mean(axis=(1, 3))
    return np.clip(small, 0, 255).astype(np.uint8)

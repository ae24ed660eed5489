# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Simulate how a depth camera degrades a clean depth image: noise, edges, drop-outs, glass.

Figures for the time-of-flight model (Kinect v2) follow Fankhauser et al. 2015, *Kinect v2 for
mobile robot navigation: evaluation and modeling*, eq. for the axial noise, and Wasenmueller &
Stricker 2016, *Comparison of Kinect v1 and v2 depth images in terms of accuracy and precision*
(flying pixels at depth edges, no quantisation beyond 1 mm, an offset that drifts slowly over
the image). Those for the structured-light model (Kinect v1) follow Nguyen et al. 2012,
*Modeling Kinect sensor noise for improved 3D reconstruction and tracking*, and Khoshelham &
Elberink 2012 (depth steps that grow with the square of the distance).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from hooc_perception.core.arrays import AnyArray, Float32Array, Float64Array, Int32Array
from hooc_perception.core.config import Config, param
from hooc_perception.core.types import Camera
from hooc_perception.errors import HoocError
from hooc_perception.synthesis import sensor_kernels
import numpy as np
from scipy.spatial.transform import Rotation


@dataclass(frozen=True)
class SensorConfig(Config):
    """Errors of a simulated depth camera; the defaults are a Kinect v2 indoors."""

    model: str = param('kinect_v2', 'Time of flight (kinect_v2) or structured light (kinect_v1).',
                       choices=('kinect_v2', 'kinect_v1', 'none'))
    noise_scale: float = param(1.0, 'Factor on the axial noise.', low=0.0, high=10.0)
    lateral_px: float = param(0.35, 'Standard deviation of the image position from which a '
                              'reading comes; about 1 mm at 1 m.', 'pixels', 0.0, 3.0)
    drift_m: float = param(0.0012, 'Standard deviation of the offset that varies slowly over '
                           'the image (phase non-linearity, multipath).', 'm', 0.0, 0.05)
    edge_m: float = param(0.03, 'Depth step between neighbours that counts as an edge.', 'm',
                          0.001, 1.0)
    flying: float = param(0.30, 'Share of edge pixels that mix foreground and background.', '',
                          0.0, 1.0)
    edge_dropout: float = param(0.20, 'Share of edge pixels without a reading.', '', 0.0, 1.0)
    random_dropout: float = param(0.006, 'Share of all pixels without a reading.', '', 0.0, 1.0)
    signal_floor: float = param(0.022, 'Returned light (1 = white, frontal, at 1 m) at which '
                                '63 % of the readings survive.', '', 0.0, 1.0)
    reflectance_low: float = param(0.3, 'Darkest object; reflectances are drawn from here to 1 '
                                   'and scale the noise and the drop-outs.', '', 0.02, 1.0)
    range_low: float = param(0.45, 'Nearest reading.', 'm', 0.0, 10.0)
    range_high: float = param(4.5, 'Farthest reading.', 'm', 0.1, 100.0)
    glass_bias_low: float = param(0.010, 'Least mean shift of a translucent object in a view, '
                                  'away from the camera.', 'm', 0.0, 0.5)
    glass_bias_high: float = param(0.040, 'Largest such shift.', 'm', 0.0, 0.5)
    glass_ripple_m: float = param(0.008, 'Standard deviation of the smooth field on top of it.',
                                  'm', 0.0, 0.2)
    glass_dropout: float = param(0.35, 'Share of pixels on translucent objects without a '
                                 'reading.', '', 0.0, 1.0)
    quantum_m: float = param(0.001, 'Step of the readings; 0 = none.', 'm', 0.0, 0.1)


KINECT_V1 = SensorConfig(model='kinect_v1', lateral_px=0.8, drift_m=0.0008, range_low=0.5,
                         range_high=6.0, edge_dropout=0.35)


def randomised(config: SensorConfig, rng: np.random.Generator) -> SensorConfig:
    """
    Return a copy of `config` with values drawn around the given ones.

    Noise factors vary by about a third, shares by a half; a tenth of the draws are a
    structured-light camera, so that training does not depend on one sensor.
    """
    if config.model == 'none':
        return config
    base = KINECT_V1 if rng.random() < 0.1 else config
    declared = SensorConfig.parameters()
    drawn: dict[str, float] = {}
    for name, value, spread in (
            ('noise_scale', base.noise_scale, .35), ('lateral_px', base.lateral_px, .3),
            ('drift_m', base.drift_m, .5), ('flying', base.flying, .4),
            ('edge_dropout', base.edge_dropout, .4), ('random_dropout', base.random_dropout, .4),
            ('signal_floor', base.signal_floor, .4), ('glass_dropout', base.glass_dropout, .3)):
        bounds = declared[name].metadata
        around = float(value * np.exp(spread * rng.standard_normal()))
        drawn[name] = min(max(around, bounds['low']), bounds['high'])
    return replace(base, **drawn)


def smooth_field(shape: tuple[int, int], rng: np.random.Generator, cells: int = 6) -> Float32Array:
    """Return an (H, W) float32 field of unit variance whose bumps are about 1 / cells wide."""
    height, width = shape
    knots = rng.standard_normal((cells + 2, cells + 2)).astype(np.float32)
    return sensor_kernels.upsample(knots, height, width)


def sense(depth: AnyArray, ids: AnyArray, camera: Camera, rng: np.random.Generator,
          config: SensorConfig = SensorConfig(), translucent_ids: Sequence[int] = (),
          behind: AnyArray | None = None,
          normals: AnyArray | None = None) -> tuple[Float32Array, Int32Array]:
    """
    Return (depth, ids) as measured by a depth camera.

    :param depth: (H, W) float32 clean depth, metres, inf or NaN where there is no surface.
    :param ids: (H, W) int32 of the visible objects, -1 for the surroundings or nothing.
    :param camera: gives K; the image may be distorted, K is only used for slopes.
    :param translucent_ids: ids of objects with the systematic error of glass.
    :param behind: (H, W) float32 depth of the scene without the translucent objects, or None;
        bounds how far behind its surface glass can be measured.
    :param normals: (H, W, 3) unit normals, camera frame, or None (taken from the depth).
    :return: depth (H, W) float32 metres, NaN = no reading; ids (H, W) int32 of the surface
        from which each reading comes.
    :raises HoocError: if the shapes disagree.
    """
    if depth.shape != ids.shape or (normals is not None and normals.shape[:2] != depth.shape):
        raise HoocError(f'depth {depth.shape} and ids {ids.shape} of a simulated view differ in '
                        'shape; render them with the same camera')
    clean = np.ascontiguousarray(depth, np.float32)
    ids = np.ascontiguousarray(ids, np.int32)
    if config.model == 'none':
        return np.where(np.isfinite(clean), clean, np.float32(np.nan)), ids
    n = max(int(ids.max(initial=-1)), max(translucent_ids, default=-1)) + 1
    K = camera.K
    cosine = sensor_kernels.incidence(clean, K[0, 0], K[1, 1], K[0, 2], K[1, 2])
    if normals is not None:
        cosine = _cosine_from_normals(normals, K)
    drift = smooth_field(depth.shape, rng) * np.float32(config.drift_m)
    reflectance = np.exp(rng.uniform(np.log(config.reflectance_low), 0.0, n + 1))
    reflectance[n] = 0.8
    shift = np.zeros(n + 1)
    ripple = drift
    if len(translucent_ids):
        shift[list(translucent_ids)] = rng.uniform(config.glass_bias_low,
                                                   config.glass_bias_high, len(translucent_ids))
        ripple = smooth_field(depth.shape, rng, 40) * np.float32(config.glass_ripple_m)
    glass = np.zeros(n + 1, np.bool_)
    glass[list(translucent_ids)] = True
    kernel = (sensor_kernels.time_of_flight if config.model == 'kinect_v2'
              else sensor_kernels.structured_light)
    return kernel(
        sensor_kernels.Clean(
            clean, ids, cosine,
            clean if behind is None else np.ascontiguousarray(behind, np.float32),
            behind is not None, K[0, 0]),
        sensor_kernels.Surfaces(reflectance, glass, shift, ripple, drift),
        sensor_kernels.Errors(
            config.noise_scale, config.lateral_px, config.edge_m, config.flying,
            config.edge_dropout, config.random_dropout, config.signal_floor, config.range_low,
            config.range_high, config.glass_dropout, config.quantum_m), rng)


def miscalibrated(camera: Camera, rng: np.random.Generator, rotation_rad: float,
                  translation_m: float) -> Camera:
    """
    Return the camera with the pose of a slightly wrong calibration.

    :param rotation_rad: standard deviation of the rotation about each axis.
    :param translation_m: standard deviation along each axis.
    """
    T = camera.T_world_camera.copy()
    T[:3, :3] = T[:3, :3] @ Rotation.from_rotvec(
        rotation_rad * rng.standard_normal(3)).as_matrix()
    T[:3, 3] += translation_m * rng.standard_normal(3)
    return Camera(camera.name, camera.width, camera.height, camera.K, camera.D, T,
                  camera.distortion_model)


def _cosine_from_normals(normals: AnyArray, K: Float64Array) -> Float32Array:
    """Return (H, W) float32 cosines between unit normals and the rays through the pixels."""
    h, w = normals.shape[:2]
    x = ((np.arange(w) - K[0, 2]) / K[0, 0])[None, :]
    y = ((np.arange(h) - K[1, 2]) / K[1, 1])[:, None]
    dot = normals[..., 0] * x + normals[..., 1] * y + normals[..., 2]
    return (np.abs(dot) / np.sqrt(x * x + y * y + 1)).astype(np.float32)

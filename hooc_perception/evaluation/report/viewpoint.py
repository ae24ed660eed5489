# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Where the viewer of the 3D view stands at first: everything of the scene is in the picture."""

from dataclasses import dataclass
from itertools import product

from hooc_perception.core.arrays import AnyArray, Float64Array
from hooc_perception.core.types import Camera
import numpy as np

FIELD_DEG = 36.0
ELEVATION_RAD = 0.65
# Between the viewer and the first camera, around the table.
BESIDE_RAD = 0.5
# Of the view on the page; see .stage in page.html.j2.
ASPECT = 16 / 9
# Share of the picture that a scene may take.
FILL = 0.94
# Points without extent would otherwise have the viewer inside of them.
LEAST_RADIUS_M = 0.1
# How near and how far the viewer can go, in distances of the first view.
NEAREST, FARTHEST = 0.05, 5.0


@dataclass(frozen=True)
class Viewpoint:
    """
    A viewer that looks at a point, z up.

    :ivar eye: (3,) float64 world metres; `target` the point in the middle of the picture.
    :ivar field_deg: vertical angle of the picture.
    :ivar near, far: clipping distances, metres: nothing is cut off at any zoom in the limits.
    :ivar nearest, farthest: limits of the distance from the target, metres.
    """

    eye: Float64Array
    target: Float64Array
    field_deg: float
    near: float
    far: float
    nearest: float
    farthest: float

    def camera(self, size: tuple[int, int]) -> Camera:
        """Return the Camera that draws the view in a picture of size (width, height)."""
        width, height = size
        right, up, back = axes(*direction(self.eye - self.target))
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = np.column_stack([right, -up, -back]), self.eye
        focal = height / 2 / np.tan(np.radians(self.field_deg) / 2)
        K = np.array([[focal, 0, (width - 1) / 2], [0, focal, (height - 1) / 2], [0, 0, 1]])
        return Camera('viewer', width, height, K, np.zeros(5), T)


def direction(offset: AnyArray) -> tuple[float, float]:
    """Return (azimuth from x towards y, elevation) of an offset (3,), radians."""
    x, y, z = (float(v) for v in offset)
    return float(np.arctan2(y, x)), float(np.arctan2(z, np.hypot(x, y)))


def axes(azimuth: float, elevation: float) -> tuple[Float64Array, Float64Array, Float64Array]:
    """Return the picture's axes in the world: right, up, and back towards the viewer."""
    back = np.array([np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation),
                     np.sin(elevation)])
    right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    return right, np.cross(back, right), back


def azimuth_beside(camera: Camera, target: AnyArray) -> float:
    """
    Return the azimuth of a viewer who stands to the left of a camera that looks at a target.

    From there the camera does not hide what it sees. A camera straight above has no azimuth: the
    lower edge of its image is then in front.
    """
    offset = camera.T_world_camera[:3, 3] - np.asarray(target)
    if np.hypot(*offset[:2]) < 0.1 * np.linalg.norm(offset):
        offset = camera.T_world_camera[:3, 1]
    return direction(offset)[0] - BESIDE_RAD


def viewpoint(shown: AnyArray, azimuth: float, around: AnyArray | None = None,
              elevation: float = ELEVATION_RAD, aspect: float = ASPECT) -> Viewpoint:
    """
    Return the Viewpoint that sees all points, as large as the picture allows.

    A picture that is wider than `aspect` shows more at its sides.

    :param shown: (n, 3) world metres; none at all count as one point at the origin.
    :param around: (n, 3) further points that must not be cut off once they are in the picture.
    :param aspect: width of the picture by its height.
    """
    shown = np.asarray(shown, float).reshape(-1, 3)
    shown = shown[np.isfinite(shown).all(1)]
    if not len(shown):
        shown = np.zeros((1, 3))
    target = (shown.min(0) + shown.max(0)) / 2
    local = shown - target
    if np.linalg.norm(local, axis=1).max() < LEAST_RADIUS_M:
        local = LEAST_RADIUS_M / np.sqrt(3) * np.array(list(product((-1, 1), repeat=3)))
    right, up, back = axes(azimuth, elevation)
    tangent = np.tan(np.radians(FIELD_DEG) / 2) * FILL
    # A point p at depth D - p.back is in the picture if |p.axis - shift| <= t (D - p.back): the
    # least D along each axis, and the shift of the target that allows it.
    distance, shift = 0.0, np.zeros(3)
    for axis, t in ((right, tangent * aspect), (up, tangent)):
        most, least = ((sign * local @ axis + t * local @ back).max() for sign in (1, -1))
        distance = max(distance, float(most + least) / (2 * t))
        shift += (most - least) / 2 * axis
    target = target + shift
    others = np.zeros((0, 3)) if around is None else np.asarray(around) - target
    reach = float(np.linalg.norm(np.concatenate([local - shift, others]), axis=1).max())
    nearest, farthest = NEAREST * distance, FARTHEST * distance
    return Viewpoint(target + distance * back, target, FIELD_DEG, nearest / 10,
                     1.1 * (farthest + reach), nearest, farthest)

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Bananas: they lie on a side, the stalk towards -x, bent around -y."""

from collections.abc import Callable

from hooc_perception.objects.catalogue.draw import Draw
from hooc_perception.objects.catalogue.hafts import resized, smooth
from hooc_perception.objects.catalogue.shapes import sweep
from manifold3d import Manifold
import numpy as np
import numpy.typing as npt


def banana(draw: Draw) -> Manifold:
    """Return a banana that lies on its side, with a stalk."""
    along = np.linspace(0, 1, 24)
    angle = np.radians(-52 + 104 * along)
    bend = 0.105
    path = np.column_stack([bend * np.sin(angle), bend * np.cos(angle) - bend, 0 * angle])
    girth = np.interp(along, [0, 0.05, 0.10, 0.22, 0.5, 0.78, 0.93, 0.97, 1],
                      [0.0045, 0.0045, 0.006, 0.0155, 0.019, 0.0165, 0.008, 0.0045, 0.004])
    girth = girth * draw.about(1.0)
    return resized(sweep(path, girth, girth * 0.95, sides=7), draw)


def _bent_fruit(draw: Draw, length: float, bend_deg: float, girth: float,
                rows: npt.ArrayLike, sides: int = 12, skew: float = 0.0,
                hook_deg: float = 0.0, tilt: float = 0.0) -> Manifold:
    """
    Return a fruit along an arc.

    :param bend_deg: angle between the directions of its ends.
    :param girth: greatest radius; `rows` hold (share of the length, share of the girth).
    :param skew: > 0 = bent more strongly near the stalk, < 0 = near the tip.
    :param hook_deg: by which the stalk itself is bent; negative = away from the bend.
    :param tilt: rise of the tip over the table, as a share of the length.
    """
    length, girth = draw.about(length, 0.12), draw.about(girth, 0.12)
    shape = smooth(rows, 20)
    along = shape[:, 0]
    turn = np.radians(draw.about(bend_deg, 0.25))
    angle = turn * (0.5 - along + skew * along * (1.0 - along))
    angle += np.radians(hook_deg) * np.clip(1.0 - along / 0.16, 0.0, 1.0)
    step = np.diff(along, prepend=0.0) * length
    middle = np.append(angle[:1], 0.5 * (angle[1:] + angle[:-1]))
    path = np.column_stack([np.cumsum(step * np.cos(middle)), np.cumsum(step * np.sin(middle)),
                            tilt * length * along ** 2])
    path -= 0.5 * (path.min(axis=0) + path.max(axis=0))
    radius = girth * shape[:, 1]
    return resized(sweep(path, radius, radius * draw.about(0.95, 0.08), sides), draw)


def straight_banana(draw: Draw) -> Manifold:
    """Return a long banana that is almost straight."""
    return _bent_fruit(draw, 0.205, 38.0, 0.0175, [
        (0.0, 0.32), (0.08, 0.33), (0.13, 0.42), (0.26, 0.88), (0.55, 1.0), (0.82, 0.85),
        (0.95, 0.4), (0.985, 0.24), (1.0, 0.2)])


def curled_banana(draw: Draw) -> Manifold:
    """Return a thick, strongly bent banana."""
    return _bent_fruit(draw, 0.215, 150.0, 0.0195, [
        (0.0, 0.26), (0.07, 0.27), (0.12, 0.42), (0.24, 0.87), (0.5, 1.0), (0.8, 0.86),
        (0.95, 0.4), (0.98, 0.24), (1.0, 0.2)], sides=9)


def angular_banana(draw: Draw) -> Manifold:
    """Return a banana with five sharp ridges and a short stalk."""
    return _bent_fruit(draw, 0.185, 85.0, 0.021, [
        (0.0, 0.3), (0.05, 0.3), (0.16, 0.8), (0.45, 1.0), (0.8, 0.92), (0.94, 0.45), (1.0, 0.2)],
        sides=5)


def crooked_banana(draw: Draw) -> Manifold:
    """Return a banana bent near its long, crooked stalk."""
    return _bent_fruit(draw, 0.215, 90.0, 0.0178, [
        (0.0, 0.42), (0.03, 0.3), (0.14, 0.3), (0.2, 0.5), (0.33, 0.92), (0.58, 1.0),
        (0.84, 0.85), (0.955, 0.4), (1.0, 0.2)], sides=8, skew=0.8,
        hook_deg=draw.between(-45.0, 5.0))


def small_banana(draw: Draw) -> Manifold:
    """Return a small, plump banana with blunt ends."""
    return _bent_fruit(draw, 0.112, 60.0, 0.0165, [
        (0.0, 0.25), (0.06, 0.25), (0.12, 0.55), (0.25, 0.9), (0.5, 1.0), (0.78, 0.92),
        (0.93, 0.5), (1.0, 0.18)], sides=10)


def plantain(draw: Draw) -> Manifold:
    """Return a plantain: long, thick and ridged, with tapering ends."""
    return _bent_fruit(draw, 0.265, 65.0, 0.0235, [
        (0.0, 0.28), (0.06, 0.27), (0.2, 0.68), (0.48, 1.0), (0.72, 0.88), (0.9, 0.42),
        (1.0, 0.14)], sides=draw.pick(6, 5), skew=draw.between(-0.5, 0.5))


def toy_banana(draw: Draw) -> Manifold:
    """Return a smooth banana of plastic: of even thickness, with round ends, no stalk."""
    return _bent_fruit(draw, 0.165, 95.0, 0.018, [
        (0.0, 0.2), (0.02, 0.5), (0.07, 0.8), (0.2, 0.97), (0.5, 1.0), (0.8, 0.97),
        (0.93, 0.8), (0.98, 0.5), (1.0, 0.2)], sides=16)


def tip_bent_banana(draw: Draw) -> Manifold:
    """Return a banana bent near its pointed tip, which rises from the table."""
    return _bent_fruit(draw, 0.195, 80.0, 0.0185, [
        (0.0, 0.3), (0.09, 0.3), (0.17, 0.62), (0.35, 1.0), (0.6, 0.97), (0.82, 0.75),
        (0.93, 0.38), (1.0, 0.2)], sides=10, skew=-0.8, tilt=draw.between(-0.08, 0.08))


def flattened_banana(draw: Draw) -> Manifold:
    """Return a banana as a scan on a table shows it: its lower side cut flat."""
    fruit = _bent_fruit(draw, 0.19, 75.0, 0.0195, [
        (0.0, 0.35), (0.08, 0.36), (0.15, 0.6), (0.3, 0.95), (0.6, 1.0), (0.85, 0.8),
        (0.96, 0.4), (1.0, 0.25)], sides=12)
    return fruit.trim_by_plane((0.0, 0.0, 1.0), -draw.between(0.006, 0.014))


STYLES: dict[str, tuple[Callable[[Draw], Manifold], ...]] = {
    'banana': (banana, straight_banana, curled_banana, crooked_banana, angular_banana,
               toy_banana, plantain, tip_bent_banana, small_banana, flattened_banana)}

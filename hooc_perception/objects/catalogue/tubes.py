# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Styles of tubes beside the common cardboard one; they lie along y, caps towards +y."""

from hooc_perception.objects.catalogue.draw import Draw
from hooc_perception.objects.catalogue.hafts import resized, slab
from hooc_perception.objects.catalogue.shapes import (
    box,
    cylinder,
    ellipse,
    outline,
    rounded_rectangle,
)
from manifold3d import Manifold
import numpy as np
import numpy.typing as npt


def _turned(profile: npt.ArrayLike, segments: int = 36) -> Manifold:
    """Return a closed profile (n, 2) of (radius, y) revolved, lying on z = 0."""
    profile = np.asarray(profile, float)
    solid = outline(profile).revolve(segments).rotate((-90.0, 0.0, 0.0))
    low, high = solid.bounding_box()[1], solid.bounding_box()[4]
    return solid.translate((0.0, -0.5 * (low + high), profile[:, 0].max()))


def _pipe(radius: float, length: float, wall: float, segments: int = 36) -> Manifold:
    """Return an open tube."""
    return _turned([(radius, 0.0), (radius, length), (radius - wall, length),
                    (radius - wall, 0.0)], segments)


def _squeezed(round_rows: npt.ArrayLike, width: float, length: float, flat: float,
              cap: tuple[float, float]) -> Manifold:
    """
    Return a squeeze tube: flat at -y, round at its shoulder, with a cap.

    :param round_rows: rows of (share of the length, half height), from the flat end on.
    :param width: half width of the flat end.
    :param flat: length of the pressed end.
    :param cap: (radius, length) of the cap.
    """
    rows = np.asarray(round_rows, float)
    end = rows[-1, 1]
    solids = []
    for share, half in rows:
        wide = width + (end - width) * share
        ring = ellipse(wide, half, segments=24).extrude(0.0005).rotate((-90.0, 0.0, 0.0))
        solids.append(ring.translate((0.0, share * length, end)))
    body = Manifold()
    for a, b in zip(solids[:-1], solids[1:], strict=True):
        body += (a + b).hull()
    crimp = box(2 * width, flat, 2 * rows[0, 1], at=(0.0, -flat / 2 + 0.001, end - rows[0, 1]))
    shoulder = cylinder(0.97 * end, 0.006, at=(0.0, length, end), axis='y',
                        top=min(0.6 * end, cap[0]), segments=24)
    top = cylinder(cap[0], cap[1] + 0.004, at=(0.0, length + 0.002, end), axis='y',
                   top=0.94 * cap[0], segments=20)
    whole = body + crimp + shoulder + top
    return whole.translate((0.0, -0.5 * (length + cap[1]), 0.0))


def toothpaste(draw: Draw) -> Manifold:
    """Return a tube of toothpaste: pressed flat at one end, a small round cap at the other."""
    end, length = draw.about(0.0185), draw.about(0.135, 0.2)
    thin = draw.about(0.0018, 0.25)
    return resized(_squeezed([(0.0, thin), (0.3, 0.45 * end), (0.7, 0.85 * end), (1.0, end)],
                             1.35 * end, length, 0.010,
                             (end * draw.between(0.5, 0.95), draw.about(0.022, 0.25))), draw)


def crisps_tube(draw: Draw) -> Manifold:
    """Return a tube of crisps: closed, with rims at both ends and a lid."""
    r, length = draw.about(0.0375), draw.about(0.230, 0.2)
    rim = draw.about(0.0015, 0.3)
    lid = draw.about(0.009, 0.3)
    return resized(_turned([(0.0, 0.004), (r - 0.002, 0.004), (r - 0.002, 0.0), (r + rim, 0.0),
                            (r + rim, 0.003), (r, 0.004), (r, length - lid),
                            (r + rim, length - lid), (r + rim, length), (r - 0.004, length),
                            (r - 0.005, length - 0.002), (0.0, length - 0.002)]), draw)


def short_tube(draw: Draw) -> Manifold:
    """Return a short cardboard core, as of toilet paper."""
    r = draw.about(0.0215)
    return resized(_pipe(r, draw.about(0.105), draw.about(0.0012, 0.3)), draw)


def mailing_tube(draw: Draw) -> Manifold:
    """Return a mailing tube with plugs in its ends."""
    r, length = draw.about(0.033, 0.2), draw.about(0.300)
    plug, wall = draw.about(0.006, 0.4), draw.about(0.0025, 0.3)
    sunk = draw.chance(0.5)
    edge = (r - wall, plug) if sunk else (r + 0.001, -plug)
    low = [(0.0, edge[1]), (edge[0], edge[1]), (edge[0], 0.0)]
    high = [(x, length - y) for x, y in low[::-1]]
    return resized(_turned([*low, (r, 0.0), (r, length), *high]), draw)


def cream_tube(draw: Draw) -> Manifold:
    """Return a cosmetics tube: short and wide, its cap as wide as its shoulder."""
    end, length = draw.about(0.022, 0.2), draw.about(0.105, 0.2)
    return resized(_squeezed([(0.0, 0.0016), (0.35, 0.55 * end), (0.75, 0.92 * end), (1.0, end)],
                             draw.between(1.2, 1.5) * end, length, 0.007,
                             (end * draw.between(0.92, 1.0), draw.about(0.030, 0.3))), draw)


def thick_pipe(draw: Draw) -> Manifold:
    """Return a thick-walled pipe, as of plastic, maybe with a wider socket."""
    r, length = draw.about(0.0245, 0.25), draw.about(0.165, 0.2)
    wall = draw.between(0.15, 0.35) * r
    socket = draw.between(1.1, 1.25) * r if draw.chance(0.5) else r
    return resized(_turned([(r, 0.0), (r, 0.72 * length), (socket, 0.74 * length),
                            (socket, length), (r - wall, length), (r - wall, 0.0)]), draw)


def closed_tube(draw: Draw) -> Manifold:
    """Return a tube as a coarse scan shows it: a closed cylinder, ends flat or dished."""
    r, length = draw.about(0.024, 0.25), draw.about(0.215, 0.2)
    dish = draw.between(0.0, 0.006)
    return resized(_turned([(0.0, dish), (0.8 * r, dish), (0.85 * r, 0.0), (r, 0.0), (r, length),
                            (0.85 * r, length), (0.8 * r, length - dish),
                            (0.0, length - dish)]), draw)


def vial(draw: Draw) -> Manifold:
    """Return a tube with one closed end, round or flat, such as of tablets or for a cigar."""
    r, length = draw.about(0.0145, 0.2), draw.about(0.140, 0.2)
    wall, lip = draw.about(0.0016, 0.3), draw.between(0.0, 0.0025)
    bulge = draw.pick(1.0, 0.15, 0.5)
    angle = np.linspace(0.0, np.pi / 2, 7)
    out = np.column_stack([r * np.sin(angle), bulge * r * (1 - np.cos(angle))])
    inside = np.column_stack([(r - wall) * np.sin(angle),
                              wall + bulge * (r - wall) * (1 - np.cos(angle))])[::-1]
    return resized(_turned(np.vstack([out, [(r, length - 0.004), (r + lip, length - 0.003),
                                            (r + lip, length), (r - wall, length)], inside]),
                           28), draw)


def angular_tube(draw: Draw) -> Manifold:
    """Return a cardboard tube with a square, triangular or six-sided section, open."""
    sides = draw.pick(4, 3, 6)
    r, length = draw.about(0.030, 0.2), draw.about(0.250)
    wall = draw.about(0.0025, 0.3)
    angle = 2 * np.pi * np.arange(sides) / sides - np.pi / 2 + np.pi / sides
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    shape = outline(r * ring) - outline((r - 1.4 * wall) * ring)
    return resized(shape.extrude(length).rotate((90.0, 0.0, 0.0)).translate(
        (0.0, length / 2, r * np.cos(np.pi / sides))), draw)


def rolled_tube(draw: Draw) -> Manifold:
    """Return a half-used metal tube: its end rolled up, its body flattened."""
    end, length = draw.about(0.017, 0.2), draw.about(0.080, 0.2)
    roll = draw.about(0.0055, 0.25)
    tube = _squeezed([(0.0, 0.0014), (0.35, draw.between(0.3, 0.6) * end), (0.75, 0.8 * end),
                      (1.0, end)], 1.4 * end, length, 0.004,
                     (end * draw.between(0.4, 0.65), draw.about(0.014, 0.25)))
    y = tube.bounding_box()[1]
    coil = cylinder(roll, 2.7 * end, at=(-1.35 * end, y, end), axis='x', segments=14)
    return resized(tube + coil.translate((0.0, 0.0, draw.pick(1, -1) * 0.5 * roll)), draw)


def flattened_tube(draw: Draw) -> Manifold:
    """Return a wide, open core, as of foil or tape, pressed oval or split by a slot."""
    r, length = draw.about(0.034), draw.about(0.160, 0.2)
    wall, squash = draw.about(0.0028, 0.3), draw.between(0.6, 1.0)
    ring = ellipse(r, squash * r, segments=36) - ellipse(r - wall, squash * r - wall, segments=36)
    if draw.chance(0.3):
        ring -= rounded_rectangle(0.3 * r, r, 0.001, 4).translate((0.0, r))
    return resized(slab(ring, length).translate((0.0, 0.0, squash * r)), draw)


TUBES = (toothpaste, short_tube, crisps_tube, cream_tube, thick_pipe, mailing_tube, closed_tube,
         flattened_tube, rolled_tube, vial, angular_tube)

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Styles of spoons beside the common table spoon; the bowl is at the origin."""

from hooc_perception.objects.catalogue.draw import Draw
from hooc_perception.objects.catalogue.hafts import bar, mirrored, resized, smooth, strip
from hooc_perception.objects.catalogue.shapes import box, cylinder, ellipse
from manifold3d import Manifold
import numpy as np
import numpy.typing as npt


def _egg(length: float, width: float, depth: float, point: float) -> Manifold:
    """Return an ellipsoid of half axes, egg-shaped: narrower at +x for a positive `point`."""
    def shaped(vertices: npt.ArrayLike) -> npt.NDArray[np.float64]:
        out = np.array(vertices)
        out[:, 1] *= 1.0 - point * out[:, 0]
        return out * (length, width, depth)
    return Manifold.sphere(1.0, 28).warp_batch(shaped)


def _bowl(length: float, width: float, depth: float, wall: float, point: float = 0.0,
          level: float = 0.0) -> tuple[Manifold, Manifold]:
    """Return a spoon's bowl, open upwards at z = level, and its content."""
    inner = _egg(length - wall, width - wall, depth - wall, point)
    shell = _egg(length, width, depth, point) - inner
    return shell.trim_by_plane((0.0, 0.0, -1.0), -level), inner


def _flat_spoon(draw: Draw, length: float, width: float, depth: float, handle: npt.ArrayLike,
                wall: float = 0.0016, point: float = 0.0, arch: float = 0.010,
                end: float = 0.0, thickness: float = 0.0025) -> Manifold:
    """
    Return a spoon with a flat handle.

    :param length: half length of the bowl; `width`, `depth` likewise.
    :param handle: rows of (x, half width) from the end to the bowl, x rising.
    :param arch: height of the handle's middle above the rim.
    :param end: height of its end.
    """
    bowl, inner = _bowl(length, width, draw.about(depth, 0.25), draw.about(wall, 0.25), point)
    handle = np.vstack([handle, [(-0.85 * length, 1.1 * np.asarray(handle)[-1][1])]])
    start, arch = handle[0, 0], draw.about(arch, 0.3)
    lift = [(start, end), (0.6 * start - 0.4 * length, arch), (-1.4 * length, 0.5 * arch - 0.001),
            (-0.85 * length, -0.0035)]
    shape = mirrored(smooth(handle, 12))
    return bowl + (strip(shape, draw.about(thickness, 0.25), lift, 0.014) - inner)


def wooden_spoon(draw: Draw) -> Manifold:
    """Return a cooking spoon of wood: a shallow, thick bowl on a long round stick."""
    length, width = draw.about(0.040), draw.about(0.029)
    deep = draw.about(0.010, 0.25)
    body = _egg(length, width, deep, 0.0).trim_by_plane((0.0, 0.0, -1.0), -0.004)
    dent = _egg(0.85 * length, 0.82 * width, 0.65 * deep, 0.0).translate((0.0, 0.0, 0.004))
    thick, end = draw.about(0.0055, 0.2), draw.about(0.235)
    stick = bar([(-end - 0.03, 0.6 * thick, 0.6 * thick), (-end - 0.025, thick, thick),
                 (-0.06, 0.9 * thick, 0.8 * thick), (-0.8 * length, 1.2 * thick, 0.6 * thick,
                 -0.001)], 6)
    return resized((body + stick) - dent, draw)


def teaspoon(draw: Draw) -> Manifold:
    """Return a small spoon with a pointed bowl."""
    end = draw.about(0.006, 0.25)
    return resized(_flat_spoon(
        draw, 0.023, 0.0155, 0.0085, [(-0.112, 0.5 * end), (-0.106, end), (-0.06, 0.003),
                                      (-0.03, 0.003)],
        point=draw.between(0.1, 0.3), wall=0.0014, thickness=0.002, arch=0.009), draw)


def soup_spoon_asian(draw: Draw) -> Manifold:
    """Return a porcelain soup spoon: flat-bottomed, its handle a thick, rising channel."""
    length, width = draw.about(0.036), draw.about(0.0225)
    deep, wall = draw.about(0.018, 0.2), draw.about(0.0035, 0.2)
    low = ellipse(0.72 * length, 0.66 * width, segments=28).extrude(0.001)
    high = ellipse(length, width, segments=28).extrude(0.001)
    outer = (low + high.translate((0.0, 0.0, deep))).hull()
    inner = (ellipse(0.72 * length - wall, 0.66 * width - wall, segments=28).extrude(0.001)
             + ellipse(length - wall, width - wall, segments=28).extrude(0.001)
             .translate((0.0, 0.0, deep))).hull().translate((0.0, 0.0, wall))
    rise, far = draw.about(0.022, 0.3), draw.about(0.095)
    path = [(-far, 0.007, 0.004, deep + rise), (-far + 0.004, 0.0085, 0.005, deep + 0.97 * rise),
            (-0.05, 0.0095, 0.006, deep + 0.004), (-0.75 * length, 0.012, 0.006, 0.6 * deep)]
    groove = [(x + 0.004, 0.6 * a, 0.7 * b, z + 0.0035) for x, a, b, z in path]
    return resized((outer + bar(path, 10, 14) - bar(groove, 10, 10)) - inner, draw)


def measuring_spoon(draw: Draw) -> Manifold:
    """Return a measuring spoon: a hemisphere or a shallow cup on a flat, straight handle."""
    radius = draw.about(0.021, 0.2)
    deep, wall = radius * draw.pick(1.0, 0.6, 0.75), draw.about(0.0016, 0.25)
    bowl, inner = _bowl(radius, radius, deep, wall)
    width, end = draw.about(0.006, 0.25), draw.about(0.105)
    handle = mirrored([(-end, 0.7 * width), (-end + 0.004, width), (-0.8 * radius, width)])
    handle -= ellipse(0.45 * width, 0.45 * width, at=(-end + 0.010, 0.0), segments=12)
    flat = handle.extrude(draw.about(0.002, 0.25)).translate((0.0, 0.0, -0.0022))
    return resized(bowl + (flat - inner), draw)


def serving_spoon(draw: Draw) -> Manifold:
    """Return a large serving spoon with a broad, shallow bowl, slotted or not."""
    end = draw.about(0.012, 0.2)
    spoon = _flat_spoon(draw, draw.about(0.048, 0.12), draw.about(0.033, 0.12), 0.015,
                        [(-0.195, 0.6 * end), (-0.185, end), (-0.11, 0.5 * end),
                         (-0.06, 0.45 * end)], wall=0.002, arch=0.018, thickness=0.003)
    if draw.chance(0.3):
        for y in (-0.011, 0.0, 0.011):
            spoon -= box(0.045, 0.004, 0.1, at=(0.0, y, -0.05))
    return resized(spoon, draw)


def long_spoon(draw: Draw) -> Manifold:
    """Return a latte spoon: a small bowl on a very long, thin handle."""
    width = draw.about(0.003, 0.25)
    return resized(_flat_spoon(
        draw, 0.019, 0.0135, 0.006, [(-0.185, 0.7 * width), (-0.18, 1.2 * width), (-0.1, width),
                                     (-0.028, width)],
        wall=0.0015, thickness=0.003, arch=0.006), draw)


def round_soup_spoon(draw: Draw) -> Manifold:
    """Return a soup spoon with a round, deep bowl and a handle that broadens."""
    end = draw.about(0.010, 0.2)
    radius = draw.about(0.024, 0.12)
    return resized(_flat_spoon(
        draw, radius, 0.96 * radius, 0.013, [(-0.150, 0.8 * end), (-0.142, end),
                                             (-0.08, 0.6 * end), (-0.035, 0.4 * end)],
        thickness=0.003, arch=0.014), draw)


def closed_spoon(draw: Draw) -> Manifold:
    """Return a spoon as a coarse scan shows it: thick, the bowl only a dent."""
    length, width, deep = draw.about(0.033), draw.about(0.022), draw.about(0.010, 0.25)
    body = _egg(length, width, deep, 0.1).trim_by_plane((0.0, 0.0, -1.0), -0.001)
    dent = _egg(0.8 * length, 0.8 * width, 0.4 * deep, 0.1).translate((0.0, 0.0, 0.001))
    end = draw.about(0.010, 0.2)
    shape = mirrored(smooth([(-0.15, 0.6 * end), (-0.142, end), (-0.08, 0.6 * end),
                             (-0.8 * length, 0.6 * end)], 10))
    arch = draw.about(0.012, 0.4)
    handle = strip(shape, draw.about(0.0045, 0.25), [
        (-0.15, 0.0), (-0.1, arch), (-0.05, 0.6 * arch), (-0.8 * length, -0.0042)], 0.014)
    return resized(body + handle - dent, draw)


def thick_handle_spoon(draw: Draw) -> Manifold:
    """Return a spoon with a fat handle, for a child or of a kitchen set."""
    length, width = draw.about(0.030, 0.2), draw.about(0.0215, 0.2)
    deep, fat = draw.about(0.010, 0.25), draw.about(0.0085, 0.25)
    bowl, inner = _bowl(length, width, deep, draw.about(0.0022, 0.25))
    end, rise = draw.about(0.140, 0.15), draw.between(0.0, 0.03)
    neck = bar([(-length - 0.03, 0.5 * fat, 0.35 * fat, 0.3 * rise), (-0.85 * length, 0.5 * fat,
               0.3 * fat, -0.001)], 4)
    haft = bar([(-end, 0.6 * fat, 0.5 * fat, rise), (-end + 0.006, fat, 0.8 * fat, 0.95 * rise),
                (-0.6 * end, 0.9 * fat, 0.8 * fat, 0.55 * rise),
                (-length - 0.012, 0.6 * fat, 0.5 * fat, 0.15 * rise)], 10)
    return resized(bowl + (neck + haft - inner), draw)


def ladle_spoon(draw: Draw) -> Manifold:
    """Return a scoop with a deep, round bowl and a rising round handle with an eye."""
    radius, wall = draw.about(0.031, 0.2), draw.about(0.002, 0.25)
    bowl, inner = _bowl(radius, radius, 0.75 * radius, wall)
    rise, end, thick = draw.about(0.055, 0.4), draw.about(0.185), draw.about(0.005, 0.2)
    handle = bar([(-end, thick, 0.6 * thick, rise), (-end + 0.01, 2.0 * thick, 0.7 * thick, rise),
                  (-end + 0.035, thick, 0.7 * thick, 0.9 * rise),
                  (-1.5 * radius, thick, 0.7 * thick, 0.15 * rise),
                  (-0.9 * radius, 1.2 * thick, 0.5 * thick, -0.004)], 14)
    eye = cylinder(0.8 * thick, 0.2, at=(-end + 0.011, 0.0, 0.0), segments=12)
    return resized(bowl + (handle - inner - eye), draw)


SPOONS = (wooden_spoon, teaspoon, soup_spoon_asian, measuring_spoon, serving_spoon, long_spoon,
          round_soup_spoon, closed_spoon, thick_handle_spoon, ladle_spoon)

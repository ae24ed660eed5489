# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Styles of staplers beside the common one; the hinge is at -x, the anvil at +x."""

from hooc_perception.objects.catalogue.draw import Draw
from hooc_perception.objects.catalogue.hafts import resized, slab, smooth
from hooc_perception.objects.catalogue.shapes import (
    box,
    curve,
    cylinder,
    outline,
    rounded_box,
    union,
)
from manifold3d import Manifold
import numpy as np
import numpy.typing as npt


def _arm(top: npt.ArrayLike, width: float, angle: float, pivot: tuple[float, float],
         magazine: float, low: float = 0.0) -> Manifold:
    """
    Return the upper arm with the magazine below it, turned up about a pivot.

    :param top: rows of (x, z) of the upper edge from the hinge to the nose.
    :param width: along y.
    :param angle: degrees by which the arm is raised.
    :param pivot: (x, z) of the hinge.
    :param magazine: height of the magazine; 0 = none.
    :param low: height of the lower edge.
    """
    top = np.asarray(top, float)
    arm = slab(outline(np.vstack([top, (top[-1, 0], low), (top[0, 0], low)])), width)
    if magazine:
        long = np.ptp(top[:, 0]) - 0.006
        arm += box(long, 0.55 * width, magazine + 0.002, at=(top[:, 0].mean(), 0.0,
                                                            low - magazine))
    x, z = pivot
    return arm.translate((-x, 0.0, -z)).rotate((0.0, -angle, 0.0)).translate((x, 0.0, z))


def mini_stapler(draw: Draw) -> Manifold:
    """Return a pocket stapler: short, high and rounded."""
    half, width = draw.about(0.035), draw.about(0.022)
    high, gap = draw.about(0.024, 0.2), draw.about(0.006, 0.4)
    base = rounded_box(2 * half, width, 0.006, 0.3 * width)
    hinge = box(0.022, 0.8 * width, 0.012 + gap, at=(-half + 0.013, 0.0, 0.003))
    top = smooth([(-half, 0.35 * high), (-0.5 * half, 0.95 * high), (0.2 * half, high),
                  (0.98 * half, 0.55 * high)], 8)
    arm = _arm(top, width, draw.between(0.0, 9.0), (-half, 0.0), 0.0)
    return resized(union(base, hinge, arm.translate((0.0, 0.0, 0.006 + gap))), draw)


def heavy_stapler(draw: Draw) -> Manifold:
    """Return a heavy-duty stapler: a long, flat base, a high body and a raised lever."""
    half, width = draw.about(0.112), draw.about(0.032, 0.2)
    base = rounded_box(2 * half, draw.about(1.9 * width), 0.010, 0.012)
    post = rounded_box(0.8 * half, width, 0.055, 0.008, at=(-0.5 * half, 0.0, 0.0))
    body = slab(outline([(-half, 0.028), (0.85 * half, 0.028), (0.85 * half, 0.070),
                         (0.60 * half, 0.074), (-0.9 * half, 0.058)]), width)
    rise, thick = draw.about(0.055, 0.25), draw.about(0.009, 0.2)
    line = curve([(-0.75 * half, 0.055), (0.0, 0.062 + 0.5 * rise),
                  (0.95 * half, 0.072 + rise)], 7)
    lever = slab(outline(np.vstack([line, line[::-1] + (0.0, 2 * thick)])), 0.9 * width)
    link = box(0.016, 0.4 * width, 0.03 + 0.6 * rise, at=(0.35 * half, 0.0, 0.055))
    return resized(union(base, post, body, lever, link), draw)


def open_stapler(draw: Draw) -> Manifold:
    """Return a stapler whose arm is swung wide open."""
    half, width = draw.about(0.070), draw.about(0.033)
    base = rounded_box(2 * half, width, draw.about(0.008, 0.25), 0.008)
    hinge = box(0.032, 0.85 * width, 0.026, at=(-half + 0.018, 0.0, 0.0))
    top = smooth([(-half, 0.012), (-0.4 * half, 0.022), (0.4 * half, 0.020), (half, 0.010)], 8)
    arm = _arm(top, 0.95 * width, draw.between(25.0, 80.0), (-half + 0.012, 0.006), 0.009)
    return resized(union(base, hinge, arm.translate((0.0, 0.0, 0.018))), draw)


def plier_stapler(draw: Draw) -> Manifold:
    """Return a plier stapler: jaws in front and two long levers behind."""
    width, reach = draw.about(0.017, 0.2), draw.about(0.105)
    apart = draw.about(0.034, 0.3)
    jaw_top = slab(outline([(-0.02, 0.0), (-0.02, 0.016), (0.045, 0.020), (0.058, 0.012),
                            (0.058, -0.002), (0.02, -0.002)]), width)
    jaw_low = slab(outline([(-0.02, -0.008), (-0.02, 0.002), (0.01, 0.0), (0.03, -0.014),
                            (0.058, -0.014), (0.058, -0.021), (0.02, -0.022)]), 0.9 * width)
    upper = curve([(0.03, 0.016), (-0.02, 0.018), (-0.5 * reach, 0.012 + 0.6 * apart),
                   (-reach, 0.008 + apart)], 9)
    lower = curve([(0.01, -0.014), (-0.02, -0.010), (-0.5 * reach, -0.010 - 0.35 * apart),
                   (-reach, -0.014 - 0.4 * apart)], 9)
    thick = draw.about(0.009, 0.2)
    levers = [slab(outline(np.vstack([line, line[::-1] + (0.0, side * thick)])), width)
              for line, side in ((upper, 1), (lower, -1))]
    pin = cylinder(0.010, 1.15 * width, at=(-0.01, -0.575 * width, 0.001), axis='y', segments=16)
    return resized(union(jaw_top, jaw_low, *levers, pin), draw)


def metal_stapler(draw: Draw) -> Manifold:
    """Return a long classic stapler of sheet steel: a slim, flat-topped arm with a gap."""
    half, width = draw.about(0.096), draw.about(0.030, 0.2)
    base = rounded_box(1.75 * half, 1.25 * width, 0.006, 0.5 * width).translate(
        (-0.05 * half, 0.0, 0.0))
    hinge = box(0.035, 0.9 * width, 0.036, at=(-0.72 * half, 0.0, 0.0))
    top = smooth([(-half, 0.012), (-0.85 * half, 0.021), (0.6 * half, 0.019), (0.92 * half,
                  0.017), (half, 0.004)], 9)
    arm = _arm(top, 0.8 * width, draw.between(4.0, 14.0), (-0.75 * half, 0.0), 0.012)
    return resized(union(base, hinge, arm.translate((0.0, 0.0, 0.025))), draw)


def closed_stapler(draw: Draw) -> Manifold:
    """Return a stapler as a coarse scan shows it: one block, only a groove as its gap."""
    half, width = draw.about(0.066), draw.about(0.036)
    high = draw.about(0.054, 0.2)
    side = smooth([(-half, 0.45 * high), (-0.85 * half, 0.8 * high), (-0.2 * half, high),
                   (0.5 * half, 0.92 * high), (0.95 * half, 0.72 * high), (half, 0.35 * high)],
                  10)
    body = slab(outline(np.vstack([side, (half, 0.0), (-half, 0.0)])), width)
    groove = outline([(-0.3 * half, 0.30 * high), (1.2 * half, 0.24 * high),
                      (1.2 * half, 0.40 * high), (-0.3 * half, 0.33 * high)])
    return resized(body - slab(groove, 0.2), draw)


def standing_stapler(draw: Draw) -> Manifold:
    """Return a stapler to be gripped: a fat, arched handle over a short, narrow base."""
    half, width = draw.about(0.068), draw.about(0.029)
    arch = draw.about(0.042, 0.2)
    upper = curve([(-half, 0.022), (-0.5 * half, 0.030 + 0.8 * arch), (0.3 * half, 0.034 + 0.85
                   * arch), (0.95 * half, 0.032)], 10)
    lower = curve([(0.9 * half, 0.024), (0.2 * half, 0.030), (-0.5 * half, 0.022), (-half,
                   0.012)], 8)
    body = slab(outline(np.vstack([upper, lower])), width)
    base = rounded_box(2 * half, 0.8 * width, 0.009, 0.3 * width)
    hinge = box(0.03, 0.7 * width, 0.026, at=(-0.72 * half, 0.0, 0.004))
    nose = box(0.02, 0.6 * width, 0.014, at=(0.8 * half, 0.0, 0.016))
    return resized(union(base, body, hinge, nose), draw)


def one_touch_stapler(draw: Draw) -> Manifold:
    """Return a power-saving stapler: a wedge that is highest above its nose."""
    half, width = draw.about(0.075), draw.about(0.040)
    base = rounded_box(2 * half, 1.05 * width, draw.about(0.011, 0.2), 0.012)
    high = draw.about(0.052, 0.2)
    top = smooth([(-half, 0.014), (-0.3 * half, 0.5 * high), (0.5 * half, 0.95 * high),
                  (0.85 * half, high), (0.98 * half, 0.4 * high)], 9)
    arm = _arm(top, 0.85 * width, draw.between(0.0, 4.0), (-half, 0.0), 0.006, 0.004)
    hinge = box(0.05, 0.8 * width, 0.024, at=(-half + 0.03, 0.0, 0.002))
    return resized(union(base, hinge, arm.translate((0.0, 0.0, 0.019))), draw)


def staple_gun(draw: Draw) -> Manifold:
    """Return a staple gun: a tall nose in front, a closed D-shaped handle behind."""
    width, high = draw.about(0.024, 0.2), draw.about(0.115)
    back = draw.about(0.085)
    body = outline([(-0.02, 0.0), (0.065, 0.0), (0.065, 0.35 * high), (0.05, 0.72 * high),
                    (0.0, high), (-back, high), (-back - 0.008, 0.85 * high),
                    (-back, 0.25 * high), (-0.02, 0.25 * high)])
    hole = curve([(0.012, 0.62 * high), (-0.3 * back, 0.78 * high), (-0.85 * back, 0.80 * high),
                  (-0.85 * back, 0.42 * high), (-0.2 * back, 0.42 * high), (0.012, 0.62 * high)],
                 16)[:-1]
    return resized(slab(body - outline(hole), width), draw)


STAPLERS = (mini_stapler, open_stapler, heavy_stapler, closed_stapler, metal_stapler,
            plier_stapler, standing_stapler, one_touch_stapler, staple_gun)

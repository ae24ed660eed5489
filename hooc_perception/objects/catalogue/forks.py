# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Styles of forks beside the common table fork."""

from hooc_perception.objects.catalogue.draw import Draw
from hooc_perception.objects.catalogue.hafts import bar, mirrored, resized, rod, smooth, strip
from hooc_perception.objects.catalogue.shapes import box
from manifold3d import Manifold
import numpy as np
import numpy.typing as npt


def _fork(draw: Draw, handle: npt.ArrayLike, head: float, width: float, tines: int,
          tine: float, gap: float = 0.42, thickness: float = 0.0025,
          arch: float = 0.012, dip: float = 0.008) -> Manifold:
    """
    Return a fork whose handle ends at x = 0.

    :param handle: rows of (x, half width), x rising to 0.
    :param head: length of shoulders and tines.
    :param tines: number of tines; 1 = a closed head, as poor scans have it.
    :param tine: length of the tines.
    :param gap: share of the head's width that the gaps take.
    """
    handle = np.asarray(handle, float)
    head, width = draw.about(head, 0.12), draw.about(width, 0.12)
    tine = min(tine * draw.about(1.0), 0.85 * head)
    root = head - tine
    half = np.vstack([smooth(np.vstack([handle, [(0.4 * root, 0.3 * width),
                                                 (0.9 * root, 0.5 * width)]]), 14),
                      [(head - 0.006, 0.49 * width), (head, 0.45 * width)]])
    shape = mirrored(half)
    pitch = width / max(tines - (1 - gap) * 0.4, 1)
    for i in range(tines - 1):
        y, slot = (i - (tines - 2) / 2) * pitch, gap * width / (tines - 1)
        cut = mirrored([(root, 0.3 * slot), (root + 0.003, 0.5 * slot), (head, 0.55 * slot),
                        (head + 0.01, 0.6 * slot)])
        shape -= cut.translate((0.0, y))
    arch, dip = draw.about(arch, 0.25), draw.about(dip, 0.25)
    start = handle[0, 0]
    lift = [(start, 0.5 * arch), (0.5 * start, arch), (-0.008, 0.8 * arch), (0.5 * root + 0.004,
            0.25 * arch), (0.55 * head, 0.0), (head, dip)]
    return strip(shape, draw.about(thickness, 0.25), lift, 0.014)


def cake_fork(draw: Draw) -> Manifold:
    """Return a short fork with three tines."""
    end = draw.about(0.006, 0.25)
    shape = _fork(draw, [(-0.098, 0.7 * end), (-0.09, end), (-0.04, 0.0035), (0.0, 0.003)],
                  0.045, 0.020, 3, 0.025, thickness=0.0022)
    return resized(shape, draw)


def carving_fork(draw: Draw) -> Manifold:
    """Return a long fork of two straight prongs with a thick handle."""
    spread, length = draw.about(0.011, 0.2), draw.about(0.110, 0.2)
    lines = [np.array([(0.0, 0.0, 0.0), (0.015, 0.8 * s * spread, 0.0), (0.03, s * spread, 0.0),
                       (0.6 * length, s * spread, -0.002), (length, s * spread, 0.006)])
             for s in (1, -1)]
    prongs = [rod(line, [0.0035, 0.0034, 0.0033, 0.003, 0.0012]) for line in lines]
    grip = draw.about(0.010, 0.2)
    stem = bar([(-0.05, 0.005, 0.004), (0.004, 0.004, 0.0035)])
    haft = bar([(-0.155, 0.6 * grip, 0.5 * grip), (-0.15, grip, 0.8 * grip),
                (-0.08, 0.9 * grip, 0.7 * grip), (-0.042, 0.7 * grip, 0.6 * grip)])
    return resized(prongs[0] + prongs[1] + stem + haft, draw)


def plastic_fork(draw: Draw) -> Manifold:
    """Return a throw-away fork: almost flat, its handle with raised edges."""
    end = draw.about(0.0075, 0.2)
    thick = draw.about(0.002, 0.3)
    fork = _fork(draw, [(-0.10, 0.8 * end), (-0.096, end), (-0.01, 0.8 * end), (0.0, 0.7 * end)],
                 0.062, 0.026, 4, 0.034, thickness=thick, arch=0.005, dip=0.004)
    ribs = [box(0.08, 0.0016, 0.0025 + thick, at=(-0.052, s * 0.75 * end, 0.0025))
            for s in (1, -1)]
    return resized(fork + ribs[0] + ribs[1], draw)


def heavy_fork(draw: Draw) -> Manifold:
    """Return a fork whose handle is a thick grip of wood or plastic."""
    grip = draw.about(0.0085, 0.2)
    fork = _fork(draw, [(-0.03, 0.004), (0.0, 0.0035)], 0.065, 0.025, 4, 0.042, arch=0.008)
    haft = bar([(-0.118, 0.5 * grip, 0.35 * grip, -0.002), (-0.112, grip, 0.7 * grip, -0.001),
                (-0.06, 0.85 * grip, 0.65 * grip, 0.006), (-0.02, 0.6 * grip, 0.5 * grip, 0.0065)])
    return resized(fork + haft, draw)


def child_fork(draw: Draw) -> Manifold:
    """Return a child's fork: short, with blunt tines and a fat handle."""
    fat = draw.about(0.009, 0.2)
    fork = _fork(draw, [(-0.03, 0.006), (0.0, 0.005)], 0.045, 0.024, 3, 0.020, gap=0.3,
                 arch=0.004, dip=0.006)
    haft = bar([(-0.085, 0.6 * fat, 0.5 * fat, 0.005), (-0.080, fat, 0.8 * fat, 0.005),
                (-0.05, 0.8 * fat, 0.7 * fat, 0.006), (-0.012, 0.6 * fat, 0.5 * fat, 0.005)])
    return resized(fork + haft, draw)


def slim_fork(draw: Draw) -> Manifold:
    """Return a long modern fork with a wire-like handle and long tines."""
    width = draw.about(0.0028, 0.2)
    fork = _fork(draw, [(-0.135, width), (-0.07, width), (0.0, 0.9 * width)], 0.078, 0.020, 4,
                 0.052, thickness=0.0035, arch=0.006, dip=0.010)
    return resized(fork, draw)


def closed_fork(draw: Draw) -> Manifold:
    """Return a fork as a coarse scan shows it: the gaps of the tines closed, all thick."""
    end = draw.about(0.010, 0.2)
    fork = _fork(draw, [(-0.12, 0.7 * end), (-0.11, end), (-0.05, 0.6 * end), (0.0, 0.5 * end)],
                 0.075, 0.025, 1, 0.045, thickness=0.0045, arch=0.017, dip=0.013)
    return resized(fork, draw)


def serving_fork(draw: Draw) -> Manifold:
    """Return a large serving fork: a broad, hollow head with short, wide tines."""
    end = draw.about(0.013, 0.2)
    fork = _fork(draw, [(-0.15, 0.6 * end), (-0.14, end), (-0.06, 0.5 * end), (0.0, 0.4 * end)],
                 0.085, 0.048, draw.pick(4, 3, 5), 0.030, gap=0.25, thickness=0.0028,
                 arch=0.020, dip=0.016)
    return resized(fork, draw)


def pickle_fork(draw: Draw) -> Manifold:
    """Return a slender fork with two tines."""
    end = draw.about(0.006, 0.3)
    fork = _fork(draw, [(-0.13, 0.8 * end), (-0.12, end), (-0.04, 0.003), (0.0, 0.003)],
                 0.050, 0.014, 2, 0.034, gap=0.45, arch=0.006, dip=0.003)
    return resized(fork, draw)


FORKS = (cake_fork, carving_fork, plastic_fork, heavy_fork, child_fork, slim_fork, closed_fork,
         serving_fork, pickle_fork)

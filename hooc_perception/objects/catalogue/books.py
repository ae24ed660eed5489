# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Styles of books beside the common hardback; they lie flat, the spine towards -x."""

from hooc_perception.objects.catalogue.draw import Draw
from hooc_perception.objects.catalogue.hafts import resized, slab
from hooc_perception.objects.catalogue.shapes import box, curve, cylinder, outline, union
from manifold3d import Manifold
import numpy as np


def _bound(width: float, height: float, thick: float, board: float, inset: float,
           spine: float = 0.0) -> Manifold:
    """
    Return a bound book whose pages are set back between two boards.

    :param width: along x; `height` along y.
    :param thick: of the whole book; `board` that of one board.
    :param inset: by which the pages are set back at three sides.
    :param spine: by which the spine bulges outwards; negative = inwards.
    """
    boards = [box(width, height, board, at=(0.0, 0.0, z)) for z in (0.0, thick - board)]
    pages = box(width - inset, height - 2 * inset, thick - board, at=(-0.5 * inset, 0.0,
                                                                    0.5 * board))
    bow = curve([(-width / 2, 0.0), (-width / 2 - spine, thick / 2), (-width / 2, thick)], 9)
    inner = [(-width / 2 + max(2 * board, 0.004), thick), (-width / 2 + max(2 * board, 0.004),
                                                          0.0)]
    back = slab(outline(np.vstack([bow, inner])), height)
    if spine < 0:
        hollow = slab(outline(bow), 2 * height)
        return union(pages, *boards) - hollow
    return union(pages, *boards, back)


def paperback(draw: Draw) -> Manifold:
    """Return a paperback of middling thickness: a plain block with sharp edges."""
    block = box(draw.about(0.125), draw.about(0.195), draw.about(0.018, 0.3))
    return resized(block, draw)


def thin_hardback(draw: Draw) -> Manifold:
    """Return a large, thin picture book with boards."""
    board = draw.about(0.0028, 0.2)
    thick = 2 * board + draw.about(0.006, 0.3)
    return resized(_bound(draw.about(0.215), draw.about(0.260), thick, board, 0.004), draw)


def thick_paperback(draw: Draw) -> Manifold:
    """Return a thick paperback whose spine and opposite edge are bowed from reading."""
    width, height = draw.about(0.110), draw.about(0.178)
    thick, bow = draw.about(0.042, 0.2), draw.between(-0.006, 0.007)
    left = curve([(-width / 2, 0.0), (-width / 2 - bow, thick / 2), (-width / 2, thick)], 8)
    right = curve([(width / 2, thick), (width / 2 - bow, thick / 2), (width / 2, 0.0)], 8)
    return resized(slab(outline(np.vstack([left, right])), height), draw)


def open_book(draw: Draw) -> Manifold:
    """Return a hardback whose upper cover stands a little open."""
    width, height = draw.about(0.150), draw.about(0.215)
    board, thick = draw.about(0.003, 0.2), draw.about(0.020, 0.3)
    low = union(box(width, height, board),
                box(width - 0.006, height - 0.008, thick, at=(-0.002, 0.0, 0.5 * board)),
                box(0.006, height, thick + 2 * board, at=(-width / 2 + 0.003, 0.0, 0.0)))
    cover = box(width, height, board, at=(width / 2, 0.0, 0.0)).rotate(
        (0.0, -draw.between(4.0, 28.0), 0.0))
    return resized(low + cover.translate((-width / 2 + 0.001, 0.0, thick + 0.8 * board)), draw)


def dictionary(draw: Draw) -> Manifold:
    """Return a thick, heavy volume: large boards, a round spine, pages set well back."""
    board, thick = draw.about(0.0035, 0.2), draw.about(0.055, 0.2)
    return resized(_bound(draw.about(0.165), draw.about(0.235), thick, board,
                          draw.about(0.006, 0.3), draw.about(0.011, 0.3)), draw)


def magazine(draw: Draw) -> Manifold:
    """Return a magazine or exercise book: very thin, folded at its spine, its cover ajar."""
    width, height = draw.about(0.195), draw.about(0.270)
    thick, ajar = draw.about(0.005, 0.3), draw.between(0.0, 0.012)
    top = curve([(width / 2, thick + ajar), (0.0, thick + 0.3 * ajar), (-0.4 * width, thick),
                 (-width / 2, 0.4 * thick)], 8)
    side = np.vstack([top, (-width / 2, 0.0), (width / 2, 0.0)])
    return resized(slab(outline(side), height), draw)


def ring_notebook(draw: Draw) -> Manifold:
    """Return a notebook with a wire spiral along its spine."""
    width, height = draw.about(0.145), draw.about(0.205)
    thick, ring = draw.about(0.014, 0.3), draw.about(0.0075, 0.2)
    ring = max(ring, 0.62 * thick)
    block = box(width, height, thick, at=(0.0, 0.0, ring - 0.5 * thick))
    parts = [block]
    for y in np.linspace(-0.45, 0.45, 11) * height:
        coil = cylinder(ring, 0.006, at=(-width / 2 - 0.001, y - 0.003, ring), axis='y',
                        segments=12)
        parts.append(coil)
    return resized(union(*parts), draw)


def board_book(draw: Draw) -> Manifold:
    """Return a small child's book of thick board, square, its leaves fanned at the edge."""
    side, thick = draw.about(0.130), draw.about(0.022, 0.25)
    height = side * draw.between(0.85, 1.25)
    leaves, gap = draw.pick(5, 4, 6), draw.between(0.0, 0.008)
    leaf = thick / leaves
    parts = [box(0.010, height, thick, at=(-side / 2 + 0.005, 0.0, 0.0))]
    for i in range(leaves):
        sheet = box(side, height, 0.96 * leaf, at=(side / 2, 0.0, 0.0)).rotate(
            (0.0, -np.degrees(gap * i / (leaves - 1) / side) * 2, 0.0))
        parts.append(sheet.translate((-side / 2, 0.0, i * leaf)))
    return resized(union(*parts), draw)


def flat_spined_hardback(draw: Draw) -> Manifold:
    """Return a modern novel: a square spine that is flush with the boards."""
    board = draw.about(0.0025, 0.25)
    thick = draw.about(0.033, 0.25)
    return resized(_bound(draw.about(0.140), draw.about(0.212), thick, board,
                          draw.about(0.0045, 0.3)), draw)


def ring_binder(draw: Draw) -> Manifold:
    """Return a binder: a wedge, thicker at its spine, hollow at its other edge."""
    width, height = draw.about(0.245), draw.about(0.290)
    thick, thin, board = draw.about(0.055, 0.2), draw.about(0.030, 0.3), draw.about(0.003, 0.2)
    thin = min(thin, thick)
    outer = outline([(-width / 2, 0.0), (width / 2, 0.0), (width / 2, thin),
                     (-width / 2, thick)])
    inner = outline([(-width / 2 + board, board), (width, board), (width, thin - board
                     - 0.5 * (thick - thin)), (-width / 2 + board, thick - board)])
    fill = draw.between(0.3, 0.8)
    pages = box(width - 0.03, height - 0.025, fill * (thin - board), at=(-0.013, 0.0, 0.5 * board))
    return resized(slab(outer - inner, height) + pages, draw)


BOOKS = (paperback, thin_hardback, dictionary, thick_paperback, open_book, flat_spined_hardback,
         magazine, board_book, ring_notebook, ring_binder)

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Cut a mesh into convex pieces for physics, by planes that minimise the air in the hulls."""

from hooc_perception.core.arrays import Float64Array
from hooc_perception.core.types import GenericModel
from hooc_perception.objects.repair import closed
import manifold3d
import numpy as np
import trimesh

MAX_PIECES = 24
# A piece is convex enough if its hull has less than this share of air, or if the air is less
# than this share of the whole mesh.
AIR_SHARE = 0.12
AIR_OF_WHOLE = 0.006


def convex_pieces(solid: trimesh.Trimesh, max_pieces: int = MAX_PIECES) -> list[Float64Array]:
    """
    Return a list of (n, 3) float64 hull vertices that together cover a mesh, metres.

    The piece with most air in its hull is cut in two repeatedly, by the plane across one of
    its axes that leaves the least air; a cup needs about 20 pieces, a box one.

    :param solid: watertight; other meshes are replaced by their convex hull.
    """
    whole = manifold3d.Manifold(manifold3d.Mesh(
        np.asarray(solid.vertices, np.float32), np.asarray(solid.faces, np.uint32)))
    if whole.is_empty() or whole.volume() <= 0:
        return [np.asarray(solid.convex_hull.vertices, np.float64)]
    total = whole.volume()
    done, open_pieces = [], [_Piece(p) for p in whole.decompose()]
    while open_pieces and len(done) + len(open_pieces) < max_pieces:
        open_pieces.sort(key=lambda piece: piece.air)
        worst = open_pieces.pop()
        if worst.air < AIR_SHARE * worst.hull_volume or worst.air < AIR_OF_WHOLE * total:
            done.append(worst)
            continue
        halves = worst.cut()
        if not halves:
            done.append(worst)
        open_pieces.extend(halves)
    pieces = [np.asarray(p.hull.to_mesh().vert_properties[:, :3], np.float64)
              for p in done + open_pieces]
    return [p for p in pieces if len(p) >= 4]


def pieces_of(model: GenericModel) -> list[Float64Array]:
    """Return the `convex_pieces` of a model, made a solid first where its mesh is open."""
    return convex_pieces(closed(trimesh.Trimesh(model.vertices, model.faces, process=False)))


class _Piece:
    """A part of the solid, its hull, and the volume of air in the hull."""

    def __init__(self, part: manifold3d.Manifold) -> None:
        self.part, self.hull = part, part.hull()
        self.hull_volume = self.hull.volume()
        self.air = self.hull_volume - part.volume()

    def cut(self) -> list['_Piece']:
        """Return the parts on both sides of the best of the tried planes, [] if none cuts."""
        box = np.array(self.part.bounding_box())
        low, high = box[:3], box[3:]
        best, least = [], np.inf
        for axis in range(3):
            if high[axis] - low[axis] < 0.004:
                continue
            normal = np.eye(3)[axis]
            for share in (0.5, 0.25, 0.75, 0.1, 0.9):
                at = low[axis] + share * (high[axis] - low[axis])
                sides = [s for s in self.part.split_by_plane(normal, at) if not s.is_empty()]
                if len(sides) < 2:
                    continue
                air = sum(s.hull().volume() for s in sides)
                # Ties (a bowl halved has as much air as before) go to the long axis' middle.
                air *= 1.0 - 1e-3 * (high[axis] - low[axis]) / np.max(high - low)
                if air < least:
                    best, least = sides, air
        return [_Piece(p) for s in best for p in s.decompose() if p.volume() > 1e-10]

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Conversions between trimesh and manifold3d."""

import manifold3d
import numpy as np
import trimesh

# Thickness that a surface without any is given.
SHEET_M = 0.0025


def to_manifold(mesh: trimesh.Trimesh) -> manifold3d.Manifold:
    """Return the Manifold of a mesh; its status tells whether the mesh is one."""
    return manifold3d.Manifold(manifold3d.Mesh64(
        np.array(mesh.vertices, np.float64, order='C'),
        np.array(mesh.faces, np.uint64, order='C')))


def from_manifold(solid: manifold3d.Manifold) -> trimesh.Trimesh:
    """Return the mesh of a Manifold."""
    out = solid.to_mesh64()
    return trimesh.Trimesh(np.array(out.vert_properties[:, :3]),
                           np.array(out.tri_verts, np.int64), process=False)

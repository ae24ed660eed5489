# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Small models and cameras for the tests of synthetic scenes."""

from hooc_perception.core.types import Camera
from hooc_perception.objects.derive import derive
from hooc_perception.synthesis.rigs import look_at
import numpy as np
import pytest
import trimesh

K = np.array([[366.0, 0, 255.5], [0, 366.0, 211.5], [0, 0, 1]])


def meshes():
    """Return six closed meshes of household size: {name: trimesh.Trimesh}."""
    return {'box': trimesh.creation.box((0.18, 0.12, 0.06)),
            'can': trimesh.creation.cylinder(0.035, 0.11, sections=32),
            'ring': trimesh.creation.annulus(0.03, 0.045, 0.05, sections=32),
            'ball': trimesh.creation.icosphere(3, 0.04),
            'rod': trimesh.creation.box((0.2, 0.012, 0.008)),
            'plate': trimesh.creation.cylinder(0.1, 0.012, sections=32)}


@pytest.fixture(scope='session')
def models():
    """Return GenericModels of six simple things; class id c is models[c - 1]."""
    return tuple(derive(name, mesh, np.random.default_rng(0), surface_points=64,
                        interior_points=32) for name, mesh in meshes().items())


@pytest.fixture(scope='session')
def cameras():
    """Return two cameras without distortion that look at the table from both sides."""
    return tuple(Camera(f'c{i}', 512, 424, K, np.zeros(5), look_at([x, -0.3, 0.7], [0, 0, 0]))
                 for i, x in enumerate((0.8, -0.8)))


@pytest.fixture(scope='session')
def camera():
    """Return a camera at the origin that looks along +z."""
    return Camera('c', 512, 424, K, np.zeros(5), np.eye(4))

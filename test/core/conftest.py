# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Small rendered scenes for the tests of the stages."""

from types import SimpleNamespace

from hooc_perception.core.frame.costs import PixelCosts
from hooc_perception.core.frame.frame import Frame
from hooc_perception.core.geometry import posed_vertices, stage_rng
from hooc_perception.core.hypotheses.propose import propose, ProposeConfig
from hooc_perception.core.render import render_depth
from hooc_perception.core.segment.observe import observe
from hooc_perception.core.segment.rectify import rectify
from hooc_perception.core.types import (
    Camera,
    Candidates,
    DepthView,
    PixelProbabilities,
    RectifiedView,
)
from hooc_perception.objects.derive import derive
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
import trimesh

BOX_FACES = np.array([[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
                      [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]], np.int32)


def box(centre, size):
    """Return (vertices (8, 3), faces) of an upright box."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    return np.asarray(centre) + 0.5 * corners * size, BOX_FACES


def table():
    """Return a mesh of the table top, in tiles so that none reaches behind a camera."""
    edge = np.linspace(-0.6, 0.6, 7)
    vertices, faces = [], []
    for x0, x1 in zip(edge[:-1], edge[1:]):
        for y0, y1 in zip(edge[:-1], edge[1:]):
            n = len(vertices)
            vertices += [[x0, y0, 0], [x1, y0, 0], [x1, y1, 0], [x0, y1, 0]]
            faces += [[n, n + 1, n + 2], [n, n + 2, n + 3]]
    return np.array(vertices, float), np.array(faces, np.int32)


def camera(name, azimuth, distance=1.0, elevation=0.7, width=160, height=130, focal=150.0):
    """Return a camera that looks at the origin."""
    position = distance * np.array([np.cos(azimuth) * np.cos(elevation),
                                    np.sin(azimuth) * np.cos(elevation), np.sin(elevation)])
    z = -position / distance
    x = np.cross(z, [0, 0, 1.0])
    x /= np.linalg.norm(x)
    T = np.eye(4)
    T[:3, :3] = np.column_stack([x, np.cross(z, x), z])
    T[:3, 3] = position
    K = np.array([[focal, 0, (width - 1) / 2], [0, focal, (height - 1) / 2], [0, 0, 1]])
    return Camera(name, width, height, K, np.zeros(5), T)


def rig(n=3, start=0.3):
    """Return n cameras around the table."""
    return tuple(camera(f'camera{i}', start + 2 * np.pi * i / n) for i in range(n))


def views_of(meshes, cameras):
    """Return (RectifiedView tuple, ids tuple) of noise-free depth; id -1 is the table."""
    views, ids = [], []
    for c in cameras:
        depth, index = render_depth([*meshes, table()], c)
        views.append(RectifiedView(c, np.where(np.isfinite(depth), depth, np.nan)))
        ids.append(np.where(index == len(meshes), -1, index))
    return tuple(views), tuple(ids)


def observed(meshes, cameras=None):
    """Return the Observation of meshes on the table."""
    return observe(views_of(meshes, cameras or rig())[0])


@pytest.fixture(scope='session')
def small():
    """Return the functions above: importlib mode lets test modules share nothing else."""
    return SimpleNamespace(box=box, rig=rig, views_of=views_of, observed=observed,
                           probabilities_of=probabilities_of, desk_with=desk_with)


THINGS = {'box': trimesh.creation.box((0.14, 0.10, 0.06)),
          'ball': trimesh.creation.icosphere(3, 0.04),
          'can': trimesh.creation.cylinder(0.03, 0.12, sections=32)}


def desk_with(models, truth, seed=0, extra=()):
    """
    Return a desk with the objects `truth` (Candidates), seen by three small noisy cameras.

    `extra` are further meshes, of no class. The depth has 1 mm of noise, 1 % of holes and whole
    millimetres. Fields: models (class ids 1 box, 2 ball, 3 can), cameras, truth, meshes (posed),
    clean (depth, inf = none), classes ((H, W), 0 none) and views (raw DepthView) of each camera,
    observation, probabilities (from the true classes, sure but not certain), and the frame that
    holds both.
    """
    rng = np.random.default_rng(seed)
    cameras = tuple(camera(f'camera{i}', 0.3 + 2 * np.pi * i / 3, 0.75, 0.75, height=120,
                           focal=190.0) for i in range(3))
    meshes = [(posed_vertices(shape, truth.translation[i], truth.rotation_xyzw[i],
                              truth.size[i]), shape.faces)
              for i, shape in enumerate(truth.shapes(models))]
    category = np.append(truth.category, np.zeros(len(extra) + 1, np.uint16))
    clean, classes, views = [], [], []
    for c in cameras:
        depth, ids = render_depth([*meshes, *extra, table()], c)
        clean.append(depth)
        classes.append(category[np.maximum(ids, -1)] * (ids >= 0))
        noisy = np.round(depth + rng.normal(0, 0.001, depth.shape), 3)
        noisy[~np.isfinite(depth) | (rng.random(depth.shape) < 0.01)] = np.nan
        views.append(DepthView(c, noisy.astype(np.float32)))
    observation = observe([rectify(v) for v in views])
    probabilities = probabilities_of(observation, classes, len(models))
    return SimpleNamespace(
        models=models, cameras=cameras, truth=truth, meshes=meshes, clean=clean,
        classes=classes, views=tuple(views), observation=observation,
        probabilities=probabilities, frame=Frame(observation, probabilities, models))


def probabilities_of(observation, classes, n_models):
    """Return the PixelProbabilities of a classifier that knows the (H, W) true classes."""
    camera_index, uv, p = [], [], []
    for k, view in enumerate(observation.views):
        rows, columns = np.nonzero(view.foreground)
        row = np.full((len(rows), n_models + 1), 10, np.uint8)
        row[np.arange(len(rows)), classes[k][rows, columns]] = 255 - 10 * n_models
        camera_index.append(np.full(len(rows), k, np.uint8))
        uv.append(np.column_stack([columns, rows]).astype(np.uint16))
        p.append(row)
    return PixelProbabilities(*(np.concatenate(x) for x in (camera_index, uv, p)))


@pytest.fixture(scope='session')
def things():
    """Return the GenericModels of a box, a ball and a can."""
    return tuple(derive(name, mesh, np.random.default_rng(0)) for name, mesh in THINGS.items())


@pytest.fixture(scope='session')
def desk(things):
    """Return a desk with one of each, apart from each other; see `desk_with`."""
    return desk_with(things, Candidates(
        np.array([1, 2, 3], np.uint16),
        np.array([[-0.08, 0.05, 0.03], [0.09, 0.06, 0.04], [0.02, -0.10, 0.06]]),
        Rotation.from_rotvec([[0, 0, 0.4], [0, 0, 0], [0, 0, 0]]).as_quat(),
        np.array([m.extents for m in things], np.float32), np.ones(3, np.float32)))


@pytest.fixture(scope='session')
def empty_desk(things):
    """Return a desk on which nothing stands."""
    return desk_with(things, Candidates.empty())


@pytest.fixture(scope='session')
def make_desk(things):
    """Return a function: Candidates -> desk with them, of the things or of other models."""
    return lambda truth, seed=0, models=things, extra=(): desk_with(models, truth, seed, extra)


@pytest.fixture(scope='session')
def cheap():
    """Return a ProposeConfig that finds three things in a second, with no draws to spare."""
    return ProposeConfig(samples=8000, pool=40, refine_steps=50, polish=8, polish_steps=20,
                         least_effort=1.0, per_category=5, round_samples=1500,
                         round_pool=20, round_per_category=3)


@pytest.fixture(scope='session')
def desk_pool(desk, cheap):
    """Return the Candidates that are proposed for the desk."""
    return propose(desk.frame, cheap, PixelCosts(), stage_rng(0, 'propose'))

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Let objects come to rest on the table by physics (MuJoCo): stacked, leaning, in any pose."""

from collections import OrderedDict
from dataclasses import dataclass, replace

from hooc_perception.core.config import Config, param
from hooc_perception.core.geometry import matrix_from_pose, transform
from hooc_perception.errors import HoocError
from hooc_perception.objects.repair import closed
from hooc_perception.synthesis.convex import convex_pieces
from hooc_perception.synthesis.reshape import reshape
from hooc_perception.synthesis.scatter import models_key, PlacedObject
import mujoco
import numpy as np
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation
import trimesh

# Household ware weighs about this much a litre of its own volume (plastic, wood, ceramics).
DENSITY = 700.0
STEP_S = 0.004


@dataclass(frozen=True)
class SettleConfig(Config):
    """How objects are laid down before physics takes over."""

    upright: float = param(0.45, 'Share of objects set down in a stable resting pose of their '
                           'model, as a hand would; the others are dropped at any angle.', '',
                           0.0, 1.0)
    crowding: float = param(0.9, 'Sum of the footprints over the area of the disc that objects '
                            'are dropped into; over about 0.7, they start to stack.', '',
                            0.02, 5.0)
    drop_m: float = param(0.01, 'Height that an object is dropped from, above what lies there.',
                          'm', 0.0, 0.5)
    places: int = param(1, 'Places looked at for each object; the lowest one is taken. 1 heaps '
                        'things up, more spread them as a hand does.', '', 1, 50)
    large_first: bool = param(False, 'Lay large things down first, by and large.')
    between_s: float = param(0.16, 'Time between two objects.', 's', 0.02, 5.0)
    rest_s: float = param(1.6, 'Longest time to come to rest after the last one.', 's',
                          0.1, 30.0)
    reach_m: float = param(0.5, 'Objects whose centre ends farther from the origin are '
                           'discarded.', 'm', 0.05, 5.0)


@dataclass(frozen=True)
class Body:
    """
    What physics needs of one object.

    :ivar category: class id 1..N; `vertices` (V, 3), `faces` (F, 3): the mesh that is seen,
        model axes, centred on its bounding box.
    :ivar pieces: list of (n, 3) convex vertex sets in the same axes.
    :ivar rest_rotations: (R, 4) xyzw, may be empty.
    """

    category: int
    vertices: np.ndarray
    faces: np.ndarray
    pieces: list
    rest_rotations: np.ndarray


def settle(bodies, rng, config=SettleConfig()):
    """
    Drop the bodies in random order and return the PlacedObject list of what came to rest.

    :param bodies: sequence of Body.
    :return: those that lie on the table within reach, poses of the bounding-box centres; the
        order is that of dropping.
    """
    if not bodies:
        return []
    areas = np.array([_footprint(body) for body in bodies])
    order = rng.permutation(len(bodies))
    if config.large_first:
        order = np.argsort(-areas * np.exp(0.5 * rng.standard_normal(len(bodies))))
    bodies = [bodies[i] for i in order]
    model = _compile(bodies)
    data = mujoco.MjData(model)
    radius = np.sqrt(areas.sum() / (np.pi * config.crowding))
    released = []
    for i, body in enumerate(bodies):
        _release(model, data, bodies, i, released, radius, rng, config)
        released.append(i)
        for _ in range(int(config.between_s / STEP_S)):
            mujoco.mj_step(model, data)
    quiet = 0
    for k in range(int(config.rest_s / STEP_S)):
        mujoco.mj_step(model, data)
        moving = [i for i in released if data.qpos[7 * i + 2] > -0.05]
        speed = np.abs(data.qvel.reshape(-1, 6)[moving])
        quiet = quiet + 1 if not len(moving) or (
            speed[:, :3].max() < 0.01 and speed[:, 3:].max() < 0.15) else 0
        if quiet >= 12:
            break
    return [placed for i, body in enumerate(bodies)
            if (placed := _at_rest(model, data, i, body, config)) is not None]


def _compile(bodies):
    """Return the MjModel of a table and the bodies, all parked far below it."""
    spec = mujoco.MjSpec()
    spec.option.timestep = STEP_S
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_PYRAMIDAL
    spec.option.iterations = 30
    common = {'condim': 6, 'friction': [0.7, 0.01, 0.002], 'solref': [0.01, 1.0],
              'solimp': [0.95, 0.99, 0.001, 0.5, 2]}
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[2, 2, 0.1], **common)
    for i, body in enumerate(bodies):
        node = spec.worldbody.add_body(pos=[3.0 * (i + 1), 0, -50])
        node.add_freejoint()
        pieces, volumes = _weighty(body)
        mass = np.clip(DENSITY * volumes.sum(), 0.03, 3.0)
        for k, piece in enumerate(pieces):
            name = f'{i}_{k}'
            spec.add_mesh(name=name, uservert=np.asarray(piece, np.float64).ravel(),
                          maxhullvert=32, inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX)
            node.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name,
                          mass=mass * volumes[k] / volumes.sum(), contype=0, conaffinity=0,
                          **common)
    model = spec.compile()
    # A little drag on the rotation, as felt and air give: round things come to rest too.
    drag = model.dof_damping.reshape(-1, 6)
    mass = model.body_mass[1:, None]
    drag[:, :3] = 0.3 * mass
    drag[:, 3:] = 5e-4 * mass
    return model


def _weighty(body):
    """Return (pieces, volumes (n,) m^3), slivers left out; a box where nothing remains."""
    kept = [(p, volume) for p in body.pieces
            if (volume := ConvexHull(p, qhull_options='QJ').volume) > 1e-9]
    if not kept:
        half = np.maximum(0.5 * np.ptp(body.vertices, axis=0), 0.002)
        corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * half
        kept = [(corners, 8 * half.prod())]
    return [p for p, _ in kept], np.array([volume for _, volume in kept])


def _release(model, data, bodies, i, released, radius, rng, config):
    """Put body i above a random place of the pile, at rest, and let it collide from now on."""
    body = bodies[i]
    if rng.random() < config.upright and len(body.rest_rotations):
        rest = body.rest_rotations[rng.integers(min(len(body.rest_rotations), 3))]
        rotation = (Rotation.from_rotvec(0.03 * rng.standard_normal(3))
                    * Rotation.from_euler('z', rng.uniform(-np.pi, np.pi))
                    * Rotation.from_quat(rest))
    else:
        rotation = Rotation.from_quat(rng.standard_normal(4))
    turned = body.vertices @ rotation.as_matrix().T
    low, high = turned.min(axis=0), turned.max(axis=0)
    piled = [transform(_pose(data, j), bodies[j].vertices) for j in released]
    # A place inside the disc for the whole object where it fits, for its middle otherwise.
    room = max(radius - 0.25 * np.linalg.norm((high - low)[:2]), 0.3 * radius)
    best, lowest = None, np.inf
    for _ in range(config.places):
        angle, r = rng.uniform(0, 2 * np.pi), room * np.sqrt(rng.random())
        xy = np.array([r * np.cos(angle), r * np.sin(angle)]) - 0.5 * (low + high)[:2]
        top = max((_top(points, low[:2] + xy, high[:2] + xy) for points in piled), default=0.0)
        if top < lowest:
            best, lowest = xy, top
    data.qpos[7 * i:7 * i + 3] = [*best, lowest - low[2] + config.drop_m]
    data.qpos[7 * i + 3:7 * i + 7] = rotation.as_quat()[[3, 0, 1, 2]]
    data.qvel[6 * i:6 * i + 6] = 0.0
    geoms = model.geom_bodyid == i + 1
    model.geom_contype[geoms] = 1
    model.geom_conaffinity[geoms] = 1
    # MuJoCo's broad phase reads masks of whole bodies that were summed up when it compiled.
    model.body_contype[i + 1] = 1
    model.body_conaffinity[i + 1] = 1


def _footprint(body):
    """Return the area that a body covers when it lies on its broadest side, m^2."""
    broad = np.argsort(np.ptp(body.vertices, axis=0))[1:]
    return ConvexHull(body.vertices[:, broad], qhull_options='QJ').volume


def _pose(data, i):
    """Return T_world_model (4, 4) of body i."""
    pose = data.qpos[7 * i:7 * i + 7]
    return matrix_from_pose(pose[:3], pose[[4, 5, 6, 3]])


def _top(points, low, high):
    """Return how high points (n, 3) reach over a rectangle of the table, 0 if they miss it."""
    if np.any(points[:, :2].min(axis=0) > high) or np.any(points[:, :2].max(axis=0) < low):
        return 0.0
    over = np.all((points[:, :2] > low) & (points[:, :2] < high), axis=1)
    # Large faces may cover the rectangle without a vertex in it.
    return points[over, 2].max() if over.any() else points[:, 2].max()


def _at_rest(model, data, i, body, config):
    """Return the PlacedObject of body i, None where it fell off or rolled away."""
    pose = data.qpos[7 * i:7 * i + 7]
    if not np.all(np.isfinite(pose)) or pose[2] < -0.01 or np.hypot(*pose[:2]) > config.reach_m:
        return None
    quaternion = Rotation.from_quat(pose[[4, 5, 6, 3]]).as_quat(canonical=True)
    translation = pose[:3].copy()
    world = transform(matrix_from_pose(translation, quaternion), body.vertices)
    # Contacts are a little soft: what sank into the table by a hair stands on it.
    lift = max(0.0, -world[:, 2].min())
    translation[2] += lift
    world[:, 2] += lift
    return PlacedObject(body.category, translation, quaternion,
                        body.vertices.max(axis=0) - body.vertices.min(axis=0), world, body.faces)


class BodyMaker:
    """Makes bodies of generic models; cuts every mesh into convex pieces only once."""

    def __init__(self, models):
        """Take a sequence of GenericModel; class id c is models[c - 1]."""
        self.models = tuple(models)
        self._pieces = {}

    def pieces(self, index):
        """Return the cached convex pieces of models[index]."""
        if index not in self._pieces:
            model = self.models[index]
            solid = closed(trimesh.Trimesh(model.vertices, model.faces, process=False))
            self._pieces[index] = convex_pieces(solid)
        return self._pieces[index]

    def body(self, category, rng, strength=0.0, symmetry=True):
        """Return a Body of the model with class id `category`, reshaped by `strength`."""
        model = self.models[category - 1]
        pieces = self.pieces(category - 1)
        if strength <= 0:
            return Body(category, model.vertices, model.faces, pieces, model.rest_rotations)
        vertices, _, warp = reshape(model.vertices, model.faces, rng, strength,
                                    model.symmetry if symmetry else None)
        return Body(category, vertices, model.faces, [warp(p) for p in pieces],
                    model.rest_rotations)


def varied(config, rng):
    """Return a copy of the config laid down in another manner: tidier, or more of a heap."""
    return replace(config, upright=float(rng.uniform(0.3, 0.9)),
                   crowding=float(config.crowding * np.exp(rng.normal(0, 0.3))),
                   places=int(rng.integers(1, 5)), large_first=bool(rng.random() < 0.5))


_MAKERS = OrderedDict()


def body_maker(models):
    """Return this process's BodyMaker of the models: their pieces are cut only once."""
    key = models_key(models)
    maker = _MAKERS.get(key)
    if maker is None:
        while len(_MAKERS) >= 4:
            _MAKERS.popitem(last=False)
        maker = _MAKERS[key] = BodyMaker(models)
    return maker


def settled_models(models, rng, scatter, strength, config=SettleConfig()):
    """
    Return a settled arrangement of a random subset of models, a list of PlacedObject.

    Each arrangement is laid down in a manner of its own; see `varied`.

    :param scatter: ScatterConfig, gives the range of counts and the repeats.
    :param strength: how far the objects depart from the generic shapes.
    :raises HoocError: where there are no models.
    """
    if not models:
        raise HoocError('a settled scene needs at least one model, but there are none')
    maker = body_maker(models)
    count = int(rng.integers(scatter.objects_low, scatter.objects_high + 1))
    chosen = rng.permutation(np.tile(np.arange(len(models)), scatter.repeats))[:count] + 1
    bodies = [maker.body(int(c), rng, strength) for c in chosen]
    return settle(bodies, rng, varied(config, rng))

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""A pile of bodies in physics (MuJoCo), into which one after the other is dropped."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from hooc_perception.core.arrays import Float64Array
from hooc_perception.core.config import Config, param
from hooc_perception.core.geometry import matrix_from_pose, transform
from hooc_perception.synthesis.bodies import Body
from hooc_perception.synthesis.scatter import PlacedObject
import mujoco
import numpy as np
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

# Household objects weigh about this much per m^3 of their own volume (plastic, wood, ceramics).
DENSITY = 700.0
STEP_S = 0.004
# Its compiled modules have no stubs.
mj: Any = mujoco


@dataclass(frozen=True)
class SettleConfig(Config):
    """How objects are placed before physics takes over."""

    upright: float = param(0.45, 'Share of objects placed in a stable resting pose of their '
                           'model, as by hand; the others are dropped at any angle.', '',
                           0.0, 1.0)
    crowding: float = param(0.9, 'Sum of the footprints over the area of the disc that objects '
                            'are dropped into; above about 0.7 they start to stack.', '',
                            0.02, 5.0)
    drop_m: float = param(0.01, 'Height from which an object is dropped, above what lies there.',
                          'm', 0.0, 0.5)
    places: int = param(1, 'Places tried for each object; the lowest one is used. 1 makes '
                        'heaps, more spread the objects as by hand.', '', 1, 50)
    large_first: bool = param(False, 'Place large objects first, roughly.')
    between_s: float = param(0.16, 'Time between two objects.', 's', 0.02, 5.0)
    rest_s: float = param(1.6, 'Longest time to come to rest after the last one.', 's',
                          0.1, 30.0)
    reach_m: float = param(0.5, 'Objects whose centre comes to rest farther from the origin are '
                           'discarded.', 'm', 0.05, 5.0)


class Pile:
    """
    Bodies on a table, parked far below it until they are released.

    :param bodies: in the order in which they will be released.
    """

    def __init__(self, bodies: Sequence[Body], config: SettleConfig) -> None:
        self._bodies, self._config = tuple(bodies), config
        self._model: Any = _compile(bodies)
        self._data: Any = mj.MjData(self._model)
        self._released: list[int] = []

    def release(self, i: int, radius: float, rng: np.random.Generator) -> None:
        """Put body i above a random place of the pile, at rest, and let it collide from now on."""
        body, config, model, data = self._bodies[i], self._config, self._model, self._data
        rotation = _random_rotation(body, config.upright, rng)
        turned = body.vertices @ rotation.as_matrix().T
        low, high = turned.min(axis=0), turned.max(axis=0)
        place, height = self._place(low, high, radius, rng)
        data.qpos[7 * i:7 * i + 3] = [*place, height - low[2] + config.drop_m]
        data.qpos[7 * i + 3:7 * i + 7] = rotation.as_quat()[[3, 0, 1, 2]]
        data.qvel[6 * i:6 * i + 6] = 0.0
        geoms = model.geom_bodyid == i + 1
        model.geom_contype[geoms] = 1
        model.geom_conaffinity[geoms] = 1
        # MuJoCo's broad phase reads masks of whole bodies, which were computed at compile time.
        model.body_contype[i + 1] = 1
        model.body_conaffinity[i + 1] = 1
        self._released.append(i)

    def run(self, seconds: float) -> None:
        """Simulate for a time."""
        for _ in range(int(seconds / STEP_S)):
            mj.mj_step(self._model, self._data)

    def run_to_rest(self) -> None:
        """Simulate until the bodies rest, `rest_s` at most."""
        data = self._data
        quiet = 0
        for _ in range(int(self._config.rest_s / STEP_S)):
            mj.mj_step(self._model, data)
            moving = [i for i in self._released if data.qpos[7 * i + 2] > -0.05]
            speed = np.abs(data.qvel.reshape(-1, 6)[moving])
            quiet = quiet + 1 if not len(moving) or (
                speed[:, :3].max() < 0.01 and speed[:, 3:].max() < 0.15) else 0
            if quiet >= 12:
                break

    def placed(self, i: int) -> PlacedObject | None:
        """Return body i where it lies, None if it fell off or rolled away."""
        body = self._bodies[i]
        pose = self._data.qpos[7 * i:7 * i + 7]
        if not np.all(np.isfinite(pose)) or pose[2] < -0.01 or (
                np.hypot(*pose[:2]) > self._config.reach_m):
            return None
        quaternion = Rotation.from_quat(pose[[4, 5, 6, 3]]).as_quat(canonical=True)
        translation = pose[:3].copy()
        world = transform(matrix_from_pose(translation, quaternion), body.vertices)
        # Contacts are a little soft: lift what has sunk slightly into the table.
        lift = max(0.0, -world[:, 2].min())
        translation[2] += lift
        world[:, 2] += lift
        size = body.vertices.max(axis=0) - body.vertices.min(axis=0)
        return PlacedObject(body.category, translation, quaternion, size, world, body.faces,
                            body.fold)

    def _place(self, low: Float64Array, high: Float64Array, radius: float,
               rng: np.random.Generator) -> tuple[Float64Array, float]:
        """Return (xy, height of the pile there) of the lowest of some random places for a box."""
        piled = [transform(self._pose(j), self._bodies[j].vertices) for j in self._released]
        # The whole object lies inside the disc if it fits, otherwise its middle does.
        room = max(radius - 0.25 * np.linalg.norm((high - low)[:2]), 0.3 * radius)
        best, lowest = np.zeros(2), np.inf
        for _ in range(self._config.places):
            angle, r = rng.uniform(0, 2 * np.pi), room * np.sqrt(rng.random())
            xy = np.array([r * np.cos(angle), r * np.sin(angle)]) - 0.5 * (low + high)[:2]
            top = max((_top(points, low[:2] + xy, high[:2] + xy) for points in piled),
                      default=0.0)
            if top < lowest:
                best, lowest = xy, top
        return best, lowest

    def _pose(self, i: int) -> Float64Array:
        """Return T_world_model (4, 4) of body i."""
        pose = self._data.qpos[7 * i:7 * i + 7]
        return matrix_from_pose(pose[:3], pose[[4, 5, 6, 3]])


def _random_rotation(body: Body, upright: float, rng: np.random.Generator) -> Rotation:
    """Return the rotation to drop a body with: near a resting pose with chance `upright`."""
    if rng.random() < upright and len(body.rest_rotations):
        rest = body.rest_rotations[rng.integers(min(len(body.rest_rotations), 3))]
        return (Rotation.from_rotvec(0.03 * rng.standard_normal(3))
                * Rotation.from_euler('z', rng.uniform(-np.pi, np.pi))
                * Rotation.from_quat(rest))
    return Rotation.from_quat(rng.standard_normal(4))


def _compile(bodies: Sequence[Body]) -> Any:
    """Return the MjModel of a table and the bodies, all parked far below it."""
    spec = mj.MjSpec()
    spec.option.timestep = STEP_S
    spec.option.integrator = mj.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mj.mjtCone.mjCONE_PYRAMIDAL
    spec.option.iterations = 30
    common = {'condim': 6, 'friction': [0.7, 0.01, 0.002], 'solref': [0.01, 1.0],
              'solimp': [0.95, 0.99, 0.001, 0.5, 2]}
    spec.worldbody.add_geom(type=mj.mjtGeom.mjGEOM_PLANE, size=[2, 2, 0.1], **common)
    for i, body in enumerate(bodies):
        node = spec.worldbody.add_body(pos=[3.0 * (i + 1), 0, -50])
        node.add_freejoint()
        pieces, volumes = _solid_pieces(body)
        mass = np.clip(DENSITY * volumes.sum(), 0.03, 3.0)
        for k, piece in enumerate(pieces):
            name = f'{i}_{k}'
            spec.add_mesh(name=name, uservert=np.asarray(piece, np.float64).ravel(),
                          maxhullvert=32, inertia=mj.mjtMeshInertia.mjMESH_INERTIA_CONVEX)
            node.add_geom(type=mj.mjtGeom.mjGEOM_MESH, meshname=name,
                          mass=mass * volumes[k] / volumes.sum(), contype=0, conaffinity=0,
                          **common)
    model = spec.compile()
    # A little drag, as from felt and air, so that round objects come to rest, too.
    drag = model.dof_damping.reshape(-1, 6)
    mass = model.body_mass[1:, None]
    drag[:, :3] = 0.3 * mass
    drag[:, 3:] = 5e-4 * mass
    return model


def _solid_pieces(body: Body) -> tuple[list[Float64Array], Float64Array]:
    """Return (pieces, volumes (n,) m^3) without slivers; a box if nothing remains."""
    kept = [(p, volume) for p in body.pieces
            if (volume := ConvexHull(p, qhull_options='QJ').volume) > 1e-9]
    if not kept:
        half = np.maximum(0.5 * np.ptp(body.vertices, axis=0), 0.002)
        corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * half
        kept = [(corners, 8 * half.prod())]
    return [p for p, _ in kept], np.array([volume for _, volume in kept])


def _top(points: Float64Array, low: Float64Array, high: Float64Array) -> float:
    """Return the height of points (n, 3) over a rectangle of the table, 0 if they miss it."""
    if np.any(points[:, :2].min(axis=0) > high) or np.any(points[:, :2].max(axis=0) < low):
        return 0.0
    over = np.all((points[:, :2] > low) & (points[:, :2] < high), axis=1)
    # A large face may cover the rectangle without a vertex in it.
    return points[over, 2].max() if over.any() else points[:, 2].max()

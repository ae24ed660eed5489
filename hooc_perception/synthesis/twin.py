# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
A synthetic twin of the HOOC data set, made from our own catalogue.

What the paper's section 5 says of HOOC is built in: 25 categories, each object of a scene of
another one, 5 scenes of 10 and 4 of 20 objects that stand close together and on one another,
three Kinect v2 around the table, lens distortion left in, calibration a little off, real
objects that differ from their generic models, and a jug and a glass whose depth is wrong in
another way in every view. What it does not say (sizes of table and room, heights of the
cameras) is set to what a laboratory would have.
"""

from dataclasses import dataclass, replace

from hooc_perception.core.geometry import stage_rng
from hooc_perception.errors import HoocError
from hooc_perception.io.scenes.scene import TrueObject
from hooc_perception.io.scenes.writer import NewScene, write_scene_set
from hooc_perception.objects.catalogue import CATALOGUE
from hooc_perception.objects.derive import derive
from hooc_perception.synthesis.raw_views import Caster
from hooc_perception.synthesis.rigs import ring
from hooc_perception.synthesis.room import draw_room, RoomConfig
from hooc_perception.synthesis.sensor import miscalibrated, sense, SensorConfig
from hooc_perception.synthesis.settle import body_maker, settle, SettleConfig
import joblib
import numpy as np
from tqdm import tqdm
import trimesh

SCENES = {**{f'10_{i}': 10 for i in range(1, 6)}, **{f'20_{i}': 20 for i in range(1, 5)}}
TRANSLUCENT = ('jug', 'glass')
# A checkerboard calibration of three depth cameras leaves about this much on each axis.
CALIBRATION_RAD = 0.0015
CALIBRATION_M = 0.0015
# People put most things down as they rest by themselves, and some on top of others.
LAYDOWN = SettleConfig(upright=0.8, crowding=0.75, places=3, large_first=True, reach_m=0.45)
ROOM = RoomConfig(table_low=1.3, table_high=1.6, offset=0.03, empty=0.0)
# Nobody annotates what no camera shows.
LEAST_VISIBLE = 0.08
SURFACE_SAMPLES = 3000
TRIES = 40


@dataclass(frozen=True)
class TwinOptions:
    """
    How a set departs from HOOC.

    :ivar scenes: names out of SCENES, () = all.
    :ivar cameras: number of cameras around the table.
    :ivar repeat: whether a category may stand in a scene more than once.
    :ivar strength: how far objects are from their generic models; 1 = as real ones.
    """

    scenes: tuple = ()
    cameras: int = 3
    repeat: bool = False
    strength: float = 1.0

    def __post_init__(self):
        """Raise HoocError, naming the option, where a value makes no set."""
        for name in self.scenes:
            if name not in SCENES:
                raise HoocError(f'there is no scene {name!r}; choose among {", ".join(SCENES)}')
        if not 1 <= self.cameras <= 8:
            raise HoocError(f'{self.cameras} cameras were asked for; give 1 to 8')
        if not 0 <= self.strength <= 2:
            raise HoocError(f'the strength is {self.strength:g}; give a number from 0 to 2')


def write_twin(out_dir, seed=0, options=TwinOptions(), progress=False, jobs=1):
    """
    Write a scene set in the likeness of HOOC; return its folder.

    The same seed and options give the same bytes. A scene depends on its name, the seed and
    the options other than `scenes`, so a chosen scene is the one of the full set.

    :param out_dir: a folder that does not exist yet or is empty.
    :param jobs: processes, -1 = all cores; the bytes are the same for any number.
    """
    meshes = {name: build() for name, build in CATALOGUE.items()}
    models = [derive(name, mesh, stage_rng(seed, 'twin/model', i), surface_points=64,
                     interior_points=16) for i, (name, mesh) in enumerate(meshes.items())]
    rng = stage_rng(seed, 'twin/rig', options.cameras)
    true_cameras = kinect_rig(rng, options.cameras)
    cameras = tuple(miscalibrated(c, rng, CALIBRATION_RAD, CALIBRATION_M) for c in true_cameras)
    room = replace(draw_room(rng, ROOM), yaw=rng.normal(0.0, 0.1))
    names = options.scenes or tuple(SCENES)

    def scenes():
        parallel = joblib.Parallel(n_jobs=jobs, return_as='generator')
        done = parallel(joblib.delayed(_scene)(
            name, SCENES[name], tuple(models), true_cameras, room,
            stage_rng(seed, 'twin/scene', list(SCENES).index(name)), options) for name in names)
        yield from tqdm(done, total=len(names), disable=not progress, unit='scene', desc='twin')

    return write_scene_set(out_dir, f'twin_{seed}', meshes, cameras, scenes(),
                           max_instances=0 if options.repeat else 1)


def kinect_rig(rng, count=3):
    """Return `count` raw Kinect v2 depth cameras, spread evenly around the table."""
    rig = ring(rng, count, elevation=(0.56, 0.74), distance=(1.05, 1.25), jitter=0.06,
               names=[f'kinect{i + 1}' for i in range(count)])
    cameras = []
    for camera in rig:
        # Factory calibrations of Kinect v2 depth cameras scatter by about this much.
        D = np.array([0.088, -0.268, 0.0, 0.0, 0.090]) + rng.standard_normal(5) * [
            0.006, 0.012, 3e-4, 3e-4, 0.006]
        K = camera.K.copy()
        K[[0, 1], [0, 1]] += rng.normal(0, 0.7) + rng.normal(0, 0.2, 2)
        cameras.append(replace(camera, K=K, D=D))
    return tuple(cameras)


def _scene(name, count, models, cameras, room, rng, options):
    """Return the NewScene of one name, with `count` objects."""
    maker = body_maker(models)
    placed, caster, visible = _arrangement(name, count, maker, cameras, room, rng, options)
    solids = [(o.vertices_world, o.faces) for o in placed]
    names = [maker.models[o.category - 1].name for o in placed]
    glass = tuple(i for i, n in enumerate(names) if n in TRANSLUCENT)
    opaque = Caster([m for i, m in enumerate(solids) if i not in glass] + room.meshes())
    depth = []
    for camera in cameras:
        clean, ids, normals = caster.view(camera)
        behind = opaque.view(camera)[0] if glass else None
        ids[ids >= len(placed)] = -1
        depth.append(sense(clean, ids, camera, rng, SensorConfig(), glass, behind, normals)[0])
    truth = tuple(TrueObject(n, o.translation, o.rotation_xyzw, o.size, round(float(v), 3))
                  for n, o, v in zip(names, placed, visible))
    return NewScene(name, tuple(depth), truth)


def _arrangement(name, count, maker, cameras, room, rng, options):
    """Return (objects, their Caster, visible shares) of a pile that keeps all its objects."""
    for _ in range(TRIES):
        classes = rng.choice(len(maker.models), count, replace=options.repeat) + 1
        bodies = [maker.body(int(c), rng, options.strength) for c in classes]
        placed = settle(bodies, rng, LAYDOWN)
        if len(placed) < count:
            continue
        caster = Caster([(o.vertices_world, o.faces) for o in placed] + room.meshes())
        visible = [surface_visibility(o, caster, cameras, rng) for o in placed]
        if min(visible) >= LEAST_VISIBLE:
            return placed, caster, visible
    raise HoocError(f'scene {name}: no pile of {count} objects stayed on the table in {TRIES} '
                    'tries; choose another seed')


def surface_visibility(placed, caster, cameras, rng):
    """Return the share of an object's surface that at least one camera sees (Table 1)."""
    mesh = trimesh.Trimesh(placed.vertices_world, placed.faces, process=False)
    points, _ = trimesh.sample.sample_surface(mesh, SURFACE_SAMPLES, seed=rng)
    return caster.seen(points, cameras).any(axis=1).mean()

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
A synthetic twin of the HOOC data set, made from the built-in catalogue.

It follows section 5 of the paper: 25 categories, one object per category in a scene, 5 scenes
of 10 and 4 of 20 objects that stand close together and on one another, three Kinect v2 around
the table with lens distortion and small calibration errors, and a jug and a glass whose depth
error differs in every view. Real objects differ from their generic models: here they are reshaped
copies or, with `families`, made from styles of the catalogue that training never sees. What the
paper does not state (sizes of table and room, heights of the cameras) is set to values that are
plausible for a laboratory.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from hooc_perception.core.geometry import stage_rng
from hooc_perception.core.types import Camera, GenericModel
from hooc_perception.errors import HoocError
from hooc_perception.io.scenes.scene import TrueObject
from hooc_perception.io.scenes.writer import NewScene, write_scene_set
from hooc_perception.objects.catalogue import CATALOGUE, HELD_OUT
from hooc_perception.objects.derive import derive
from hooc_perception.synthesis.bodies import body_maker, BodyMaker
from hooc_perception.synthesis.pile import SettleConfig
from hooc_perception.synthesis.population import Population, relatives_of
from hooc_perception.synthesis.raw_views import Caster
from hooc_perception.synthesis.rigs import ring, RingShape
from hooc_perception.synthesis.room import draw_room, Room, RoomConfig
from hooc_perception.synthesis.scatter import PlacedObject
from hooc_perception.synthesis.sensor import miscalibrated, sense, SensorConfig
from hooc_perception.synthesis.settle import settle
import joblib
import numpy as np
from tqdm import tqdm
import trimesh

SCENES = {**{f'10_{i}': 10 for i in range(1, 6)}, **{f'20_{i}': 20 for i in range(1, 5)}}
TRANSLUCENT = ('jug', 'glass')
# Error per axis of a checkerboard calibration of three depth cameras.
CALIBRATION_RAD = 0.0015
CALIBRATION_M = 0.0015
# People place most objects in a stable pose, and some on top of others.
PLACEMENT = SettleConfig(upright=0.8, crowding=0.75, places=3, large_first=True, reach_m=0.45)
ROOM = RoomConfig(table_low=1.3, table_high=1.6, offset=0.03, empty=0.0)
# Objects that hardly any camera shows are not annotated in real sets.
LEAST_VISIBLE = 0.08
SURFACE_SAMPLES = 3000
TRIES = 40


@dataclass(frozen=True)
class TwinOptions:
    """
    Differences of a set from HOOC.

    :ivar scenes: names from SCENES, () = all.
    :ivar cameras: number of cameras around the table.
    :ivar repeat: whether a scene may have several objects of one category.
    :ivar strength: how much objects are bent and stretched; 1 = as real ones from one mesh.
    :ivar families: whether objects are made from other styles of the catalogue than training ever
        sees, instead of from the generic models themselves.
    """

    scenes: tuple[str, ...] = ()
    cameras: int = 3
    repeat: bool = False
    strength: float = 1.0
    families: bool = False

    def __post_init__(self) -> None:
        """Raise HoocError, naming the option, if a value is out of range."""
        for name in self.scenes:
            if name not in SCENES:
                raise HoocError(f'there is no scene {name!r}; choose among {", ".join(SCENES)}')
        if not 1 <= self.cameras <= 8:
            raise HoocError(f'{self.cameras} cameras were asked for; give 1 to 8')
        if not 0 <= self.strength <= 2:
            raise HoocError(f'the strength is {self.strength:g}; give a number from 0 to 2')


def write_twin(out_dir: str | Path, seed: int = 0, options: TwinOptions = TwinOptions(),
               progress: bool = False, jobs: int = 1) -> Path:
    """
    Write a scene set that resembles HOOC; return its folder.

    The same seed and options give the same bytes. A scene depends on its name, the seed and
    the options other than `scenes`, so a selected scene equals that of the full set.

    :param out_dir: a folder that does not exist yet or is empty.
    :param jobs: processes, -1 = all cores; the bytes are the same for any number.
    """
    meshes = {name: build() for name, build in CATALOGUE.items()}
    models = [derive(name, mesh, stage_rng(seed, 'twin/model', i), surface_points=64,
                     interior_points=16) for i, (name, mesh) in enumerate(meshes.items())]
    relatives = relatives_of(models, seed, jobs, HELD_OUT) if options.families else ()
    rng = stage_rng(seed, 'twin/rig', options.cameras)
    true_cameras = kinect_rig(rng, options.cameras)
    cameras = tuple(miscalibrated(c, rng, CALIBRATION_RAD, CALIBRATION_M) for c in true_cameras)
    room = replace(draw_room(rng, ROOM), yaw=rng.normal(0.0, 0.1))
    names = options.scenes or tuple(SCENES)

    def scenes() -> Iterator[NewScene]:
        parallel = joblib.Parallel(n_jobs=jobs, return_as='generator')
        done: Any = parallel(joblib.delayed(_scene)(
            name, SCENES[name], tuple(models), relatives, true_cameras, room,
            stage_rng(seed, 'twin/scene', list(SCENES).index(name)), options) for name in names)
        yield from tqdm(done, total=len(names), disable=not progress, unit='scene', desc='twin')

    return write_scene_set(out_dir, f'twin_{seed}', meshes, cameras, scenes(),
                           max_instances=0 if options.repeat else 1)


def kinect_rig(rng: np.random.Generator, count: int = 3) -> tuple[Camera, ...]:
    """Return `count` raw Kinect v2 depth cameras, spread evenly around the table."""
    rig = ring(rng, count, shape=RingShape((0.56, 0.74), (1.05, 1.25), 0.06), prefix='kinect')
    cameras = []
    for camera in rig:
        # Factory calibrations of Kinect v2 depth cameras vary by about this much.
        D = np.array([0.088, -0.268, 0.0, 0.0, 0.090]) + rng.standard_normal(5) * [
            0.006, 0.012, 3e-4, 3e-4, 0.006]
        K = camera.K.copy()
        K[[0, 1], [0, 1]] += rng.normal(0, 0.7) + rng.normal(0, 0.2, 2)
        cameras.append(replace(camera, K=K, D=D))
    return tuple(cameras)


def _scene(name: str, count: int, models: Sequence[GenericModel], relatives: Population,
           cameras: Sequence[Camera], room: Room, rng: np.random.Generator,
           options: TwinOptions) -> NewScene:
    """Return the NewScene of one name, with `count` objects."""
    maker = body_maker(models, relatives)
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


def _arrangement(name: str, count: int, maker: BodyMaker, cameras: Sequence[Camera], room: Room,
                 rng: np.random.Generator, options: TwinOptions) -> tuple[
                     list[PlacedObject], Caster, list[float]]:
    """Return (objects, their Caster, visible shares) of a pile that keeps all its objects."""
    for _ in range(TRIES):
        classes = rng.choice(len(maker.models), count, replace=options.repeat) + 1
        bodies = [maker.body(int(c), rng, options.strength, generic_share=0.0) for c in classes]
        placed = settle(bodies, rng, PLACEMENT)
        if len(placed) < count:
            continue
        caster = Caster([(o.vertices_world, o.faces) for o in placed] + room.meshes())
        visible = [surface_visibility(o, caster, cameras, rng) for o in placed]
        if min(visible) >= LEAST_VISIBLE:
            return placed, caster, visible
    raise HoocError(f'scene {name}: no pile of {count} objects stayed on the table in {TRIES} '
                    'tries; choose another seed')


def surface_visibility(placed: PlacedObject, caster: Caster, cameras: Sequence[Camera],
                       rng: np.random.Generator) -> float:
    """Return the share of an object's surface that at least one camera sees (Table 1)."""
    mesh = trimesh.Trimesh(placed.vertices_world, placed.faces, process=False)
    points = trimesh.sample.sample_surface(mesh, SURFACE_SAMPLES, seed=rng)[0]
    return caster.seen(points, cameras).any(axis=1).mean()

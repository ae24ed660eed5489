# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The scenes of a report as a recording for the Rerun viewer (https://rerun.io)."""

from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from hooc_perception.core.arrays import AnyArray
from hooc_perception.core.types import ObservedView
from hooc_perception.errors import HoocError
from hooc_perception.evaluation.errors import world_mesh
from hooc_perception.evaluation.matching import PosedObject, shape_of
from hooc_perception.evaluation.report import pictures
from hooc_perception.evaluation.report.cloud import extent_of, KINDS, seen_points
from hooc_perception.evaluation.report.page import palette_of
from hooc_perception.evaluation.report.scene import ReportScene, ShownScene
from hooc_perception.io.scenes.files import atomic_file
import numpy as np

TIMELINE = 'scene'
POINT_RADIUS_M = 0.0012


def rerun_sdk() -> Any:
    """
    Return the module of the Rerun SDK.

    :raises HoocError: where it is not installed.
    """
    try:
        return import_module('rerun')
    except ImportError:
        raise HoocError('recordings for the Rerun viewer need its SDK; install it with '
                        '.venv/bin/pip install rerun-sdk==0.41.0') from None


def write_recording(path: str | Path, scenes: Sequence[ReportScene],
                    title: str = 'Objects on the table') -> Path:
    """
    Write scenes into one .rrd file, each at its number on the timeline `scene`.

    `world/` holds cameras with their depth, the measured points (table, explained,
    unexplained), `objects/<category>/<k>` with a mesh each and the numbers of the results, and
    `truth/...` alike, where it is known. World frame and metres, as in the results.

    :return: the path of the file.
    :raises HoocError: where the SDK is not installed or the file cannot be written.
    """
    rr, path = rerun_sdk(), Path(path)
    palette = palette_of(scenes)
    with atomic_file(path) as part:
        recording = rr.RecordingStream(title)
        recording.save(part, default_blueprint=_blueprint(rr, scenes))
        recording.log('world', rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        for number, scene in enumerate(scenes):
            recording.set_time(TIMELINE, sequence=number)
            _log_scene(rr, recording, scene, palette)
        recording.flush()
        recording.disconnect()
    return path


def _blueprint(rr: Any, scenes: Sequence[ReportScene]) -> Any:
    """Return the initial layout of the viewer: the scene in 3D without truth, depth images."""
    rrb = import_module('rerun.blueprint')
    cameras = dict.fromkeys(v.camera.name for s in scenes for v in s.observation.views)
    space = rrb.Spatial3DView(name='scene', origin='world',
                              contents=['+ $origin/**', '- $origin/cameras/**',
                                        '- $origin/truth/**'])
    images = [rrb.Spatial2DView(name=name, origin=f'world/cameras/{name}') for name in cameras]
    return rrb.Blueprint(rrb.Horizontal(
        space, rrb.Vertical(rrb.TextDocumentView(name='name', origin='name'), *images),
        column_shares=[3, 1]), collapse_panels=True)


def _log_scene(rr: Any, recording: Any, scene: ReportScene, palette: pictures.Palette) -> None:
    """Log one scene at the current time; it replaces the one before."""
    recording.log('world', rr.Clear(recursive=True))
    recording.log('name', rr.TextDocument(scene.name))
    for view in scene.observation.views:
        _log_camera(rr, recording, view)
    colours = pictures.instance_colours(scene.objects, palette)
    drawn = [i for i, o in enumerate(scene.objects) if o.category in scene.models]
    shown = ShownScene.of(scene)
    meshes = shown.meshes
    for i, mesh in zip(drawn, meshes):
        place = f'world/objects/{scene.objects[i].category}/{i}'
        _log_mesh(recording, place, scene.objects[i], mesh, colours[i])
        known = scene.evidence[i] if i < len(scene.evidence) else {}
        facts = {key: value for key, value in known.items() if value is not None}
        recording.log(place, rr.AnyValues(score=scene.objects[i].score, **facts))
    groups = seen_points(scene.observation, meshes, [colours[i] for i in drawn], shown.reasons)
    low, high = extent_of(groups, meshes)
    for kind in KINDS:
        mine = [group for group in groups if group.kind == kind]
        points, rgb = (np.concatenate([getattr(group, part) for group in mine])
                       for part in ('points', 'rgb'))
        near = ((points >= low) & (points <= high)).all(1)
        recording.log(f'world/points/{kind}', rr.Points3D(
            points[near], colors=rgb[near].clip(0, 255).astype(np.uint8), radii=POINT_RADIUS_M))
    for i, thing in enumerate(scene.truth or ()):
        if thing.category in scene.models:
            _log_mesh(recording, f'world/truth/{thing.category}/{i}', thing,
                      world_mesh(thing, shape_of(thing, scene.models)), (255, 255, 255))


def _log_camera(rr: Any, recording: Any, view: ObservedView) -> None:
    """Log the pose, the intrinsics and the depth of one view."""
    place, camera = f'world/cameras/{view.camera.name}', view.camera
    recording.log(place, rr.Transform3D(translation=camera.T_world_camera[:3, 3],
                                        mat3x3=camera.T_world_camera[:3, :3]))
    recording.log(place, rr.Pinhole(image_from_camera=camera.K,
                                    resolution=[camera.width, camera.height],
                                    camera_xyz=rr.ViewCoordinates.RDF))
    recording.log(f'{place}/depth', rr.DepthImage(np.nan_to_num(view.depth), meter=1.0))


def _log_mesh(recording: Any, place: str, thing: PosedObject, mesh: tuple[AnyArray, AnyArray],
              colour: pictures.RGB) -> None:
    """Log the posed mesh of an object as the entity `place`, with its name at its centre."""
    rr = rerun_sdk()
    recording.log(place, rr.Mesh3D(vertex_positions=mesh[0], triangle_indices=mesh[1],
                                   albedo_factor=[int(c) for c in colour]))
    recording.log(f'{place}/name', rr.Points3D([thing.translation], labels=[thing.category],
                                               colors=[int(c) for c in colour], radii=0.003))

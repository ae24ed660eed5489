# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The 3D view: its data (points, posed models, cameras, table) and a still picture of it."""

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import json
from typing import Any

from hooc_perception.core.arrays import AnyArray, Float64Array, UInt8Array
from hooc_perception.core.geometry import inverse, project, transform
from hooc_perception.core.render import render_depth
from hooc_perception.core.types import Camera, GenericModel
from hooc_perception.evaluation.errors import affine
from hooc_perception.evaluation.matching import member_of, PosedObject, shape_of
from hooc_perception.evaluation.report import pictures
from hooc_perception.evaluation.report.cloud import (
    extent_of,
    inside,
    PointGroup,
    seen_points,
    thinned,
)
from hooc_perception.evaluation.report.pictures import Palette, RGB
from hooc_perception.evaluation.report.scene import ShownScene, UNKNOWN
from hooc_perception.evaluation.report.viewpoint import azimuth_beside, Viewpoint, viewpoint
from hooc_perception.objects.shaded import render_shaded
import numpy as np

# Length of a drawn camera, in its distances from the middle of the scene.
FRUSTUM = 0.15
STILL_SIZE = (800, 450)
# A point this far behind a surface still lies on it.
ON_SURFACE_M = 0.01


class Meshes:
    """The meshes of a page, each stored once however often it is used."""

    def __init__(self) -> None:
        self._known: dict[str, dict[str, Any]] = {}

    def use(self, model: GenericModel, member: int = 0) -> str:
        """Store a mesh and its place in its family; return its name on the page."""
        name = f'{model.name}/{member}' if member else model.name
        if name not in self._known:
            unit = model.vertices / np.maximum(model.extents, 1e-9) + 0.5
            wide = len(unit) > 65535
            self._known[name] = {
                'v': packed(np.round(65535 * unit.clip(0, 1)), np.uint16),
                'f': packed(model.faces, np.uint32 if wide else np.uint16), 'wide': wide,
                'extents': [float(x) for x in model.extents]}
        return name

    def json(self) -> str:
        """Return all meshes as JSON for a script element."""
        return script_json(self._known)


def packed(values: AnyArray, kind: type[np.generic]) -> str:
    """Return an array as base64 of little-endian numbers of a type."""
    return base64.b64encode(np.ascontiguousarray(
        values, np.dtype(kind).newbyteorder('<')).tobytes()).decode()


def script_json(content: Any) -> str:
    """Return JSON that cannot end the script element that contains it."""
    return json.dumps(content, allow_nan=False).replace('<', '\\u003c')


@dataclass(frozen=True)
class Step:
    """
    What the 3D view shows of one frame set.

    :ivar colours: (r, g, b) of every drawn object.
    :ivar groups: the points in the box of the view, thinned.
    """

    shown: ShownScene
    colours: list[RGB]
    groups: list[PointGroup]


@dataclass(frozen=True)
class Space:
    """
    The 3D view of a scene, or of the frame sets of a sequence.

    :ivar low, high: (3,) the box that the points of all frame sets are in, metres.
    :ivar voxel_m: size of the cubes with one point each.
    :ivar view: where the viewer stands at first.
    """

    steps: list[Step]
    low: Float64Array
    high: Float64Array
    voxel_m: float
    view: Viewpoint

    @staticmethod
    def of(scenes: Sequence[ShownScene], palette: Palette) -> 'Space':
        """Return the 3D view of one or several frame sets."""
        colours = [pictures.instance_colours(s.drawn, palette) for s in scenes]
        groups = [seen_points(s.scene.observation, s.meshes, rgb, s.reasons)
                  for s, rgb in zip(scenes, colours)]
        meshes = [mesh for s in scenes for mesh in s.meshes]
        low, high = extent_of([g for step in groups for g in step], meshes)
        thin, voxel_m = thinned([inside(step, low, high) for step in groups])
        cameras = [view.camera for s in scenes for view in s.scene.observation.views]
        middle = (low + high) / 2
        table = [(x, y, 0.0) for x in (low[0], high[0]) for y in (low[1], high[1])]
        view = viewpoint(
            np.concatenate([table, *(g.points for step in thin for g in step),
                            *(v for v, _ in meshes)]),
            azimuth_beside(cameras[0], middle),
            np.concatenate([*(frustum(c, middle) for c in cameras),
                            *(v for s in scenes for v, _ in s.true_meshes)]))
        return Space([Step(*step) for step in zip(scenes, colours, thin)], low, high, voxel_m,
                     view)

    def json(self, rows: Sequence[Sequence[Mapping[str, Any]]], store: Meshes) -> str:
        """
        Return the view as JSON for a script element.

        :param rows: of each step, rows of the objects' table, for the details of an object that
            is clicked.
        :param store: the meshes of the page.
        """
        return script_json({
            'steps': [self._step(*step, store) for step in zip(self.steps, rows)],
            # Results are in a frame whose z = 0 is the table top.
            'table': {'low': self.low[:2].tolist(), 'high': self.high[:2].tolist(), 'z': 0.0},
            'view': {'eye': self.view.eye.tolist(), 'target': self.view.target.tolist(),
                     'field': self.view.field_deg, 'near': self.view.near, 'far': self.view.far,
                     'nearest': self.view.nearest, 'farthest': self.view.farthest}})

    def _step(self, step: Step, rows: Sequence[Mapping[str, Any]],
              store: Meshes) -> dict[str, Any]:
        """Return what changes from one frame set to the next."""
        shown, middle = step.shown, (self.low + self.high) / 2
        models, facts = shown.scene.models, {row['k']: facts_of(row) for row in rows}
        objects = [{'name': o.category, 'id': o.id, 'colour': [int(c) for c in step.colours[k]],
                    'unknown': o.category == UNKNOWN,
                    'facts': facts.get(k, [])} | placed(o, models, store)
                   for k, o in enumerate(shown.drawn)]
        return {'objects': objects, 'cloud': self._cloud(step.groups),
                'truth': [{'name': o.category} | placed(o, models, store) for o in shown.true],
                'cameras': [{'name': v.camera.name, 'frustum': frustum(v.camera, middle).tolist()}
                            for v in shown.scene.observation.views]}

    def _cloud(self, groups: Sequence[PointGroup]) -> dict[str, Any]:
        """Return points, packed, in the order of the groups."""
        points = np.concatenate([g.points for g in groups])
        rgb = np.concatenate([g.rgb for g in groups])
        span = self.high - self.low
        return {'groups': [{'camera': g.camera, 'kind': g.kind, 'n': len(g.points)}
                           for g in groups],
                'low': self.low.tolist(), 'span': span.tolist(),
                'p': packed(np.round(65535 * (points - self.low) / span), np.uint16),
                'rgb': packed(rgb.clip(0, 255), np.uint8)}

    def still(self) -> UInt8Array:
        """Return (h, w, 3) uint8: the first frame set, for browsers and prints without 3D."""
        camera, step = self.view.camera(STILL_SIZE), self.steps[0]
        rgb = render_shaded(step.shown.meshes, camera, colours=step.colours,
                            background=pictures.NOTHING).copy()
        surface = render_depth(step.shown.meshes, camera)[0]
        points = np.concatenate([g.points for g in step.groups])
        colours = np.concatenate([g.rgb for g in step.groups]).clip(0, 255)
        local = transform(inverse(camera.T_world_camera), points)
        u, v = (np.round(x).astype(int) for x in project(camera.K, local))
        # Two by two pixels each.
        x, y = (np.concatenate([u, u + 1, u, u + 1]), np.concatenate([v, v, v + 1, v + 1]))
        z, colours = np.tile(local[:, 2], 4), np.tile(colours, (4, 1))
        seen = (x >= 0) & (x < camera.width) & (y >= 0) & (y < camera.height)
        seen[seen] = z[seen] <= surface[y[seen], x[seen]] + ON_SURFACE_M
        # Far points first: near ones are drawn over them.
        order = np.flatnonzero(seen)[np.argsort(-z[seen], kind='stable')]
        rgb[y[order], x[order]] = colours[order]
        return rgb


def frustum(camera: Camera, middle: AnyArray) -> Float64Array:
    """
    Return (5, 3) world metres: a camera's centre and four points on the rays of its corners.

    The corners come in the order of a walk around the image, from its upper left.
    """
    width, height = camera.width, camera.height
    corners = np.array([[-0.5, -0.5, 1], [width - 0.5, -0.5, 1],
                        [width - 0.5, height - 0.5, 1], [-0.5, height - 0.5, 1]])
    centre = camera.T_world_camera[:3, 3]
    length = FRUSTUM * float(np.linalg.norm(centre - np.asarray(middle)))
    rays = corners @ np.linalg.inv(camera.K).T * length
    return transform(camera.T_world_camera, np.concatenate([np.zeros((1, 3)), rays]))


def placed(thing: PosedObject, models: Mapping[str, GenericModel],
           store: Meshes) -> dict[str, Any]:
    """Return the mesh of an object and its pose: the columns of A, then t, metres."""
    model = shape_of(thing, models)
    A, t = affine(thing, model)
    return {'mesh': store.use(model, member_of(thing, models)),
            'at': [float(x) for x in (*A.T.ravel(), *t)]}


def facts_of(row: Mapping[str, Any]) -> list[list[str]]:
    """Return [(label, text)] of a row of the objects' table."""
    def number(value: float | None, digits: int, unit: str) -> str | None:
        return None if value is None else f'{value:.{digits}f}{unit}'

    def triple(values: Sequence[float]) -> str:
        return ' '.join(f'{v:.1f}' for v in values) + ' cm'

    ratio, residual = row['visible_ratio'], row['residual_m']
    facts = [('score', number(row['score'], 2, '')), ('position', triple(row['at'])),
             ('size', triple(row['size'])),
             ('visible', number(None if ratio is None else 100 * ratio, 0, ' %')),
             ('residual', number(None if residual is None else 1000 * residual, 1, ' mm')),
             ('views', number(row['n_views'], 0, '')),
             ('error', number(row['error_mm'], 0, ' mm')),
             ('rotation', number(row['turn'], 0, '°'))]
    return [[name, text] for name, text in facts if text is not None]

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
from hooc_perception.evaluation.report.cloud import extent_of, PointGroup, seen_points, thinned
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
class Space:
    """
    What the 3D view of one scene shows.

    :ivar colours: (r, g, b) of every drawn object.
    :ivar groups: the points in the box (`low`, `high`), thinned.
    :ivar view: where the viewer stands at first.
    """

    shown: ShownScene
    colours: list[RGB]
    groups: list[PointGroup]
    low: Float64Array
    high: Float64Array
    view: Viewpoint

    @staticmethod
    def of(shown: ShownScene, palette: Palette) -> 'Space':
        """Return the 3D view of a scene."""
        observation = shown.scene.observation
        colours = pictures.instance_colours(shown.drawn, palette)
        groups = seen_points(observation, shown.meshes, colours)
        low, high = extent_of(groups, shown.meshes)
        groups = thinned(groups, low, high)
        cameras = [view.camera for view in observation.views]
        middle = (low + high) / 2
        table = [(x, y, 0.0) for x in (low[0], high[0]) for y in (low[1], high[1])]
        view = viewpoint(
            np.concatenate([table, *(g.points for g in groups), *(v for v, _ in shown.meshes)]),
            azimuth_beside(cameras[0], middle),
            np.concatenate([*(frustum(c, middle) for c in cameras),
                            *(v for v, _ in shown.true_meshes)]))
        return Space(shown, colours, groups, low, high, view)

    def json(self, rows: Sequence[Mapping[str, Any]], store: Meshes) -> str:
        """
        Return the view as JSON for a script element.

        :param rows: rows of the objects' table, for the details of an object that is clicked.
        :param store: the meshes of the page.
        """
        models, facts = self.shown.scene.models, {row['k']: facts_of(row) for row in rows}
        objects = [{'name': o.category, 'colour': [int(c) for c in self.colours[k]],
                    'unknown': o.category == UNKNOWN,
                    'facts': facts.get(k, [])} | placed(o, models, store)
                   for k, o in enumerate(self.shown.drawn)]
        middle = (self.low + self.high) / 2
        return script_json({
            'objects': objects, 'cloud': self._cloud(),
            'truth': [{'name': o.category} | placed(o, models, store) for o in self.shown.true],
            'cameras': [{'name': v.camera.name, 'frustum': frustum(v.camera, middle).tolist()}
                        for v in self.shown.scene.observation.views],
            # Results are in a frame whose z = 0 is the table top.
            'table': {'low': self.low[:2].tolist(), 'high': self.high[:2].tolist(), 'z': 0.0},
            'view': {'eye': self.view.eye.tolist(), 'target': self.view.target.tolist(),
                     'field': self.view.field_deg, 'near': self.view.near, 'far': self.view.far,
                     'nearest': self.view.nearest, 'farthest': self.view.farthest}})

    def _cloud(self) -> dict[str, Any]:
        """Return the points, packed, in the order of the groups."""
        points = np.concatenate([g.points for g in self.groups])
        rgb = np.concatenate([g.rgb for g in self.groups])
        span = self.high - self.low
        return {'groups': [{'camera': g.camera, 'kind': g.kind, 'n': len(g.points)}
                           for g in self.groups],
                'low': self.low.tolist(), 'span': span.tolist(),
                'p': packed(np.round(65535 * (points - self.low) / span), np.uint16),
                'rgb': packed(rgb.clip(0, 255), np.uint8)}

    def still(self) -> UInt8Array:
        """Return (h, w, 3) uint8: the first view, for browsers and prints without 3D."""
        camera = self.view.camera(STILL_SIZE)
        rgb = render_shaded(self.shown.meshes, camera, colours=self.colours,
                            background=pictures.NOTHING).copy()
        surface = render_depth(self.shown.meshes, camera)[0]
        points = np.concatenate([g.points for g in self.groups])
        colours = np.concatenate([g.rgb for g in self.groups]).clip(0, 255)
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

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The data of the 3D view: measured points, posed models, unexplained points."""

import base64
from collections.abc import Mapping, Sequence
import json
from typing import Any

from hooc_perception.core.arrays import AnyArray, Float64Array
from hooc_perception.core.geometry import back_project
from hooc_perception.core.render import render_depth
from hooc_perception.core.types import GenericModel, Observation
from hooc_perception.evaluation.errors import affine
from hooc_perception.evaluation.matching import member_of, PosedObject, shape_of
from hooc_perception.evaluation.report import pictures
from hooc_perception.evaluation.report.pictures import Palette, RGB
from hooc_perception.evaluation.report.scene import ShownScene
import numpy as np

# As core.parsing.unexplained: a pixel within this distance of the composed objects is explained.
EXPLAINED_M = 0.02
MAX_FOREGROUND, MAX_TABLE = 24000, 12000
BORDER_M = 0.12
TABLE_RGB, UNEXPLAINED_RGB = (150, 154, 160), (255, 60, 60)


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


def space_json(shown: ShownScene, rows: Sequence[Mapping[str, Any]], palette: Palette,
               store: Meshes) -> str:
    """
    Return the JSON of the 3D view of one scene.

    :param rows: rows of the objects' table, for the details of an object that is clicked.
    :param store: the meshes of the page.
    """
    models, observation = shown.scene.models, shown.scene.observation
    colours = pictures.instance_colours(shown.drawn, palette)
    facts = {row['k']: facts_of(row) for row in rows}
    objects = [{'name': o.category, 'colour': [int(c) for c in colours[k]],
                'facts': facts.get(k, [])} | placed(o, models, store)
               for k, o in enumerate(shown.drawn)]
    truth = [{'name': o.category} | placed(o, models, store) for o in shown.true]
    cloud, target = cloud_of(observation, shown.meshes, colours)
    eye = observation.views[0].camera.T_world_camera[:3, 3] - target
    return script_json({'objects': objects, 'truth': truth, 'cloud': cloud,
                        'target': [float(x) for x in target],
                        'azimuth': float(np.arctan2(eye[1], eye[0]))})


def placed(thing: PosedObject, models: Mapping[str, GenericModel],
           store: Meshes) -> dict[str, Any]:
    """Return the mesh of an object and its pose: the columns of A, then t, metres."""
    model = shape_of(thing, models)
    A, t = affine(thing, model)
    return {'mesh': store.use(model, member_of(thing, models)),
            'at': [float(x) for x in (*A.T.ravel(), *t)]}


def seen_points(observation: Observation, meshes: Sequence[tuple[AnyArray, AnyArray]],
                colours: Sequence[RGB]) -> list[tuple[Float64Array, Float64Array]]:
    """
    Return [(points (n, 3) world, rgb (n, 3) float 0-255)] of three groups of readings.

    They are the table, points that an object explains (in its colour), and unexplained points.

    :param meshes: posed objects, see `world_mesh`; `colours` one (r, g, b) each.
    """
    groups: list[list[tuple[Float64Array, Float64Array]]] = [[], [], []]
    for view in observation.views:
        points = back_project(view.depth, view.camera)
        depth, ids = render_depth(meshes, view.camera)
        with np.errstate(invalid='ignore'):
            explained = view.foreground & (np.abs(depth - view.depth) <= EXPLAINED_M)
        shade = 0.55 + 0.45 * pictures.hillshade(view.depth, view.camera)
        for k, mask in enumerate((view.table & ~view.foreground & np.isfinite(view.depth),
                                  explained, view.foreground & ~explained)):
            rgb = np.full((mask.sum(), 3), TABLE_RGB, float)
            if k == 1:
                rgb = np.array([*colours, (0, 0, 0)], float)[ids[mask]]
            elif k == 2:
                rgb[:] = UNEXPLAINED_RGB
            groups[k].append((points[mask], rgb * shade[mask][:, None]))
    return [(np.concatenate([points for points, _ in group]),
             np.concatenate([rgb for _, rgb in group])) for group in groups]


def extent_of(explained: Float64Array, left: Float64Array,
              meshes: Sequence[tuple[AnyArray, AnyArray]]) -> Float64Array:
    """Return (2, 3) the low and high corners around all objects, metres in the world."""
    standing = np.concatenate([explained, left, *(v for v, _ in meshes)])
    standing = standing[np.isfinite(standing).all(1)]
    if not len(standing):
        standing = np.array([[-0.3, -0.3, 0], [0.3, 0.3, 0.2]])
    return np.percentile(standing, [1, 99], axis=0) + np.array([[-BORDER_M], [BORDER_M]])


def cloud_of(observation: Observation, meshes: Sequence[tuple[AnyArray, AnyArray]],
             colours: Sequence[RGB]) -> tuple[dict[str, Any], Float64Array]:
    """Return (dict of the `seen_points` near the objects, (3,) middle of the objects)."""
    table, explained, left = seen_points(observation, meshes, colours)
    low, high = extent_of(explained[0], left[0], meshes)
    foreground = len(explained[0]) + len(left[0])
    kept = []
    for k, (points, rgb) in enumerate((table, explained, left)):
        inside = np.flatnonzero(((points >= low) & (points <= high)).all(1))
        most = MAX_TABLE if k == 0 else max(1, MAX_FOREGROUND * len(points) // max(foreground, 1))
        inside = inside[:: -(-len(inside) // most) or 1]
        kept.append((points[inside], rgb[inside]))
    points, rgb = (np.concatenate(part) for part in zip(*kept))
    return {'n': [len(p) for p, _ in kept], 'low': low.tolist(), 'span': (high - low).tolist(),
            'p': packed(np.round(65535 * (points - low) / (high - low)), np.uint16),
            'rgb': packed(rgb.clip(0, 255), np.uint8)}, (low + high) / 2


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

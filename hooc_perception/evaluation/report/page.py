# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Compose the report: from ReportScenes to one self-contained HTML page."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from hooc_perception.evaluation.report import pictures
from hooc_perception.evaluation.report.pictures import Palette
from hooc_perception.evaluation.report.rows import missed_rows, object_rows, rejected_rows
from hooc_perception.evaluation.report.scene import ReportScene, ShownScene, UNKNOWN
from hooc_perception.evaluation.report.space import Meshes, Space
from hooc_perception.evaluation.report.views import shaded_pictures, view_pictures
from hooc_perception.io.scenes.files import write_atomically
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

# Of things of no category.
GREY = (150, 150, 150)
TERMS = ('depth', 'probability', 'overlap')


def palette_of(scenes: Iterable[ReportScene]) -> Palette:
    """Return {category: (r, g, b)} of all categories in the scenes."""
    names = {c for s in scenes for c in (
        *s.models, *(o.category for o in (*s.objects, *(s.truth or ()))))}
    return {**pictures.colours(sorted(names - {UNKNOWN})), UNKNOWN: GREY}


def report_html(scenes: Sequence[ReportScene], title: str = 'Objects on the table',
                notes: Iterable[str] = ()) -> str:
    """
    Return the page.

    It is self-contained: pictures are PNGs inside the page, three.js inside the page draws the
    3D view, and nothing is requested from elsewhere.

    :param notes: sentences below the title, such as the profile and the name of the model.
    """
    palette = palette_of(scenes)
    environment = Environment(loader=FileSystemLoader(Path(__file__).parent), autoescape=True,
                              undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    environment.filters['pretty'] = lambda name: str(name).replace('_', ' ')
    meshes = Meshes()
    shown = [_scene(index, scene, palette, meshes) for index, scene in enumerate(scenes)]
    return environment.get_template('page.html.j2').render(
        title=title, notes=list(notes), scenes=shown, mean=_mean(shown),
        meshes=Markup(meshes.json()), viewer=Markup(_text('three/three.min.js')),
        licence=Markup(_text('three/LICENSE')), script=Markup(_text('space.js')),
        residual_cm=round(pictures.RESIDUAL_M * 100))


def _text(name: str) -> str:
    """Return a file of this folder."""
    return (Path(__file__).parent / name).read_text(encoding='utf-8')


def write_report(path: str | Path, scenes: Sequence[ReportScene],
                 title: str = 'Objects on the table', notes: Iterable[str] = ()) -> Path:
    """Write `report_html` to a file, or to report.html in a folder; return the file's path."""
    path = Path(path)
    if path.suffix.lower() not in ('.html', '.htm'):
        path = path / 'report.html'
    write_atomically(path, report_html(scenes, title, notes))
    return path


def _scene(index: int, scene: ReportScene, palette: Palette, store: Meshes) -> dict[str, Any]:
    """Return what the template shows of one scene."""
    shown = ShownScene.of(scene)
    space = Space.of(shown, palette)
    scores, rows = scene.scores or [], object_rows(scene, palette)
    return {
        'id': f's{index}', 'name': scene.name, 'energy': _energy(scene),
        'views': [view_pictures(shown, j, palette) for j in range(len(scene.observation.views))],
        'seconds': scene.seconds, 'stages': scene.stage_seconds, 'converged': scene.converged,
        'objects': rows, 'missed': missed_rows(scene, palette),
        'true': None if scene.truth is None else len(scene.truth),
        'found': sum(s.estimate is not None for s in scores),
        'localized': sum(s.localized for s in scores),
        'tight': sum(bool(s.tight) for s in scores),
        'estimated': len(scene.known), 'unknown': len(scene.objects) - len(scene.known),
        'false': len({o.category for o in scene.known}
                     - {t.category for t in scene.truth}) if scene.truth is not None else None,
        'rejected': rejected_rows(scene, palette), 'candidates': len(scene.pool),
        'space': Markup(space.json(rows, store)), 'still': pictures.data_uri(space.still()),
        'shaded': shaded_pictures(shown, palette)}


def _energy(scene: ReportScene) -> dict[str, Any] | None:
    """Return the terms of Eq. 1 and their shares, None where one of them is unknown."""
    known = scene.energy or {}
    values = [value for t in TERMS if (value := known.get(t)) is not None]
    if len(values) < len(TERMS):
        return None
    total = sum(values)
    return {'total': total, 'terms': [
        {'name': t, 'value': value, 'share': 100 * value / total if total > 0 else 0}
        for t, value in zip(TERMS, values)]}


def _mean(scenes: Sequence[dict[str, Any]]) -> dict[str, float] | None:
    """Return the means of the paper's scores over annotated scenes, None without any."""
    annotated = [s for s in scenes if s['true']]
    if not annotated:
        return None
    return {key: sum(s[key] / s['true'] for s in annotated) / len(annotated)
            for key in ('found', 'localized', 'tight')} | {
        'false': sum(s['false'] for s in annotated) / len(annotated), 'scenes': len(annotated)}

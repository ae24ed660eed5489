# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Compose the report: from scenes and sequences to one self-contained HTML page."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from hooc_perception.evaluation.report import pictures
from hooc_perception.evaluation.report.pictures import Palette
from hooc_perception.evaluation.report.rows import (
    event_rows,
    missed_rows,
    object_rows,
    rejected_rows,
)
from hooc_perception.evaluation.report.scene import ReportScene, ShownScene, UNKNOWN
from hooc_perception.evaluation.report.sequence import (
    ReportSequence,
    scenes_of,
    Shown,
    whens,
)
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
        *s.models, *(o.category for o in (*s.objects, *(s.truth or ()))),
        *(event['category'] for event in s.events or ()))}
    return {**pictures.colours(sorted(names - {UNKNOWN})), UNKNOWN: GREY}


def report_html(shown: Sequence[Shown], title: str = 'Objects on the table',
                notes: Iterable[str] = ()) -> str:
    """
    Return the page.

    It is self-contained: pictures are PNGs inside the page, three.js inside the page draws the
    3D view, and nothing is requested from elsewhere.

    :param shown: scenes, and sequences of scenes, which have a slider.
    :param notes: sentences below the title, such as the profile and the name of the model.
    """
    palette = palette_of(scenes_of(shown))
    environment = Environment(loader=FileSystemLoader(Path(__file__).parent), autoescape=True,
                              undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    environment.filters['pretty'] = lambda name: str(name).replace('_', ' ')
    meshes = Meshes()
    sections = [_sequence(f's{index}', one, palette, meshes) if isinstance(one, ReportSequence)
                else _scene(f's{index}', one, palette, meshes) for index, one in enumerate(shown)]
    scenes = [scene for section in sections for scene in section['steps'] or [section]]
    return environment.get_template('page.html.j2').render(
        title=title, notes=list(notes), sections=sections, scenes=scenes, mean=_mean(scenes),
        meshes=Markup(meshes.json()), viewer=Markup(_text('three/three.min.js')),
        licence=Markup(_text('three/LICENSE')),
        scripts=[Markup(_text(name)) for name in ('space.js', 'steps.js')],
        residual_cm=round(pictures.RESIDUAL_M * 100))


def _text(name: str) -> str:
    """Return a file of this folder."""
    return (Path(__file__).parent / name).read_text(encoding='utf-8')


def write_report(path: str | Path, shown: Sequence[Shown],
                 title: str = 'Objects on the table', notes: Iterable[str] = ()) -> Path:
    """Write `report_html` to a file, or to report.html in a folder; return the file's path."""
    path = Path(path)
    if path.suffix.lower() not in ('.html', '.htm'):
        path = path / 'report.html'
    write_atomically(path, report_html(shown, title, notes))
    return path


def _scene(place: str, scene: ReportScene, palette: Palette, store: Meshes) -> dict[str, Any]:
    """Return what the template shows of one scene; `place` is its id on the page."""
    shown, rows = ShownScene.of(scene), object_rows(scene, palette)
    return {
        'id': place, 'link': place, 'steps': (), **_figures(scene),
        'views': [view_pictures(shown, j, palette) for j in range(len(scene.observation.views))],
        'stages': scene.stage_seconds, 'converged': scene.converged,
        'objects': rows, 'missed': missed_rows(scene, palette),
        'unknown': len(scene.objects) - len(scene.known),
        'rejected': rejected_rows(scene, palette), 'candidates': len(scene.pool),
        'shaded': shaded_pictures(shown, palette), **_space([shown], [rows], palette, store)}


def _sequence(place: str, sequence: ReportSequence, palette: Palette,
              store: Meshes) -> dict[str, Any]:
    """Return what the template shows of a sequence; `place` is its id on the page."""
    steps = [{'link': f'{place}&step={number}', 'when': when, **_figures(scene),
              'known': sequence.known.get(number - 1), 'events': event_rows(scene, palette),
              'objects': object_rows(scene, palette), 'missed': missed_rows(scene, palette)}
             for number, (scene, when) in enumerate(zip(sequence.steps, whens(sequence)), 1)]
    annotated = [step for step in steps if step['true'] is not None]
    sums = {key: sum(step[key] for step in annotated) if annotated else None
            for key in ('true', 'found', 'localized', 'false')}
    return {'id': place, 'name': sequence.name, 'steps': steps, **sums,
            **_space([ShownScene.of(scene) for scene in sequence.steps],
                     [step['objects'] for step in steps], palette, store)}


def _space(scenes: Sequence[ShownScene], rows: Sequence[Sequence[dict[str, Any]]],
           palette: Palette, store: Meshes) -> dict[str, Any]:
    """Return the 3D view of one or several frame sets."""
    space = Space.of(scenes, palette)
    cameras = dict.fromkeys(v.camera.name for s in scenes for v in s.scene.observation.views)
    return {'space': Markup(space.json(rows, store)), 'still': pictures.data_uri(space.still()),
            'voxel_mm': round(1000 * space.voxel_m), 'cameras': list(cameras)}


def _figures(scene: ReportScene) -> dict[str, Any]:
    """Return the name and the figures of a scene, those of the truth None where it is unknown."""
    scores, truth = scene.scores or [], scene.truth
    return {
        'name': scene.name, 'energy': _energy(scene), 'seconds': scene.seconds,
        'true': None if truth is None else len(truth),
        'found': sum(s.estimate is not None for s in scores),
        'localized': sum(s.localized for s in scores),
        'tight': sum(bool(s.tight) for s in scores), 'estimated': len(scene.known),
        'false': None if truth is None else len(
            {o.category for o in scene.known} - {t.category for t in truth})}


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

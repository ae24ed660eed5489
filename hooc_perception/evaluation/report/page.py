# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Compose the report: from ReportScenes to one self-contained HTML page."""

from pathlib import Path

from hooc_perception.core.geometry import back_project
from hooc_perception.core.render import render_depth
from hooc_perception.evaluation.errors import world_mesh
from hooc_perception.evaluation.report import pictures
from hooc_perception.evaluation.report.shaded import shaded_picture
from hooc_perception.evaluation.report.space import Meshes, space_json
from hooc_perception.io.scenes.files import write_atomically
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup
import numpy as np

MARGIN = 0.03
REACH_M = 0.5
MAX_REJECTED = 80
TERMS = ('depth', 'probability', 'overlap')


def palette_of(scenes):
    """Return {category: (r, g, b)} of all that ReportScenes know of."""
    return pictures.colours(sorted({c for s in scenes for c in (
        *s.models, *(o.category for o in (*s.objects, *(s.truth or ()))))}))


def report_html(scenes, title='Objects on the table', notes=()):
    """
    Return the page (str) of a sequence of ReportScene.

    It needs nothing but itself: pictures are PNGs inside the page, the 3D view is drawn by a
    script inside of it; there are no requests.

    :param notes: sentences below the title, such as the profile and the model's name.
    """
    palette = palette_of(scenes)
    environment = Environment(loader=FileSystemLoader(Path(__file__).parent), autoescape=True,
                              undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    environment.filters['pretty'] = lambda name: str(name).replace('_', ' ')
    meshes = Meshes()
    shown = [_scene(index, scene, palette, meshes) for index, scene in enumerate(scenes)]
    script = (Path(__file__).parent / 'space.js').read_text(encoding='utf-8')
    return environment.get_template('page.html.j2').render(
        title=title, notes=list(notes), scenes=shown, mean=_mean(shown),
        meshes=Markup(meshes.json()), script=Markup(script),
        residual_cm=round(pictures.RESIDUAL_M * 100))


def write_report(path, scenes, title='Objects on the table', notes=()):
    """Write `report_html` to a file, or to report.html in a folder; return the file's path."""
    path = Path(path)
    if path.suffix.lower() not in ('.html', '.htm'):
        path = path / 'report.html'
    write_atomically(path, report_html(scenes, title, notes))
    return path


def _scene(index, scene, palette, store):
    """Return what the template shows of one scene."""
    # Categories that have no model cannot be drawn, only listed.
    drawn = [o for o in scene.objects if o.category in scene.models]
    true = [o for o in scene.truth or () if o.category in scene.models]
    meshes, true_meshes = ([world_mesh(o, scene.models[o.category]) for o in objects]
                           for objects in (drawn, true))
    views = [_view(scene, j, drawn, meshes, true, true_meshes, palette)
             for j in range(len(scene.observation.views))]
    scores = scene.scores
    rows = _rows(scene, scores, palette)
    found = sum(s.estimate is not None for s in scores) if scores else 0
    energy = None
    if scene.energy and all(scene.energy.get(t) is not None for t in TERMS):
        total = sum(scene.energy[t] for t in TERMS)
        energy = {'total': total, 'terms': [
            {'name': t, 'value': scene.energy[t],
             'share': 100 * scene.energy[t] / total if total > 0 else 0} for t in TERMS]}
    return {
        'id': f's{index}', 'name': scene.name, 'views': views, 'energy': energy,
        'seconds': scene.seconds, 'stages': scene.stage_seconds, 'converged': scene.converged,
        'objects': rows, 'missed': _missed(scene, scores, palette),
        'true': None if scene.truth is None else len(scene.truth), 'found': found,
        'localized': sum(s.localized for s in scores) if scores else 0,
        'tight': sum(bool(s.tight) for s in scores) if scores else 0,
        'false': len({o.category for o in scene.objects}
                     - {t.category for t in scene.truth}) if scene.truth is not None else None,
        'rejected': _rejected(scene, palette), 'candidates': len(scene.pool),
        'space': Markup(space_json(scene, drawn, meshes, true, rows, palette, store)),
        'shaded': _shaded(drawn, meshes, true, true_meshes, scene, palette)}


def _view(scene, j, drawn, meshes, true, true_meshes, palette):
    """Return the pictures of one view."""
    view = scene.observation.views[j]
    camera = view.camera
    depth, ids = render_depth(meshes, camera)
    true_ids = render_depth(true_meshes, camera)[1]
    explained = np.fmin(np.where(np.isfinite(depth), depth, np.nan), view.background)
    near = _objects(view) if view.foreground.any() else view.foreground
    rows, columns = window(near | (ids >= 0) | (true_ids >= 0), camera)
    near = view.depth[rows, columns]
    near = near[np.isfinite(near)]
    low, high = np.percentile(near, [1, 97]) if len(near) else (0.0, 1.0)
    layers = [('measured', 'measured depth',
               pictures.depth_picture(view.depth, camera, low, high)),
              ('explained', 'explained depth',
               pictures.depth_picture(explained, camera, low, high)),
              ('residual', 'residual', pictures.residual_picture(view.depth, explained))]
    if scene.probabilities is not None:
        classes = most_likely(scene.probabilities, j, view.depth.shape)
        shade = pictures.hillshade(view.depth, camera)
        layers.insert(1, ('labels', 'most likely class', pictures.class_picture(
            shade, classes, scene.class_names, palette)))
    crop = (slice(None), slice(None)) if not len(near) else (rows, columns)
    height, width = view.depth[crop].shape
    return {'camera': camera.name, 'width': width, 'height': height, 'font': width / 34,
            'layers': [{'key': key, 'title': title, 'uri': pictures.data_uri(rgb[crop])}
                       for key, title, rgb in layers],
            'outlines': _outlines(ids[crop], drawn, palette, width / 34),
            'truth': _outlines(true_ids[crop], true, palette, width / 34)}


def _objects(view):
    """Return (H, W) bool: the foreground near its middle; farther off stand only oddments."""
    points = back_project(view.depth, view.camera)[..., :2]
    middle = np.median(points[view.foreground], axis=0)
    with np.errstate(invalid='ignore'):
        return view.foreground & (np.linalg.norm(points - middle, axis=-1) < REACH_M)


def window(mask, camera):
    """Return (rows, columns) slices around a mask, with a margin, shaped like the image."""
    rows, columns = np.flatnonzero(mask.any(1)), np.flatnonzero(mask.any(0))
    if not len(rows):
        return slice(0, camera.height), slice(0, camera.width)
    pad = MARGIN * camera.width
    width = columns[-1] - columns[0] + 1 + 2 * pad
    height = rows[-1] - rows[0] + 1 + 2 * pad
    scale = max(width / camera.width, height / camera.height)
    out = []
    for ends, size in ((rows, camera.height), (columns, camera.width)):
        length = min(size, int(np.ceil(size * scale)))
        start = int(np.clip((ends[0] + ends[-1] - length) / 2, 0, size - length))
        out.append(slice(start, start + length))
    return tuple(out)


def most_likely(probabilities, view, shape):
    """Return (H, W) int32, the most likely class of every pixel of one view; 0 background."""
    classes = np.zeros(shape, np.int32)
    mine = probabilities.camera == view
    u, v = probabilities.uv[mine].astype(int).T
    classes[v, u] = probabilities.p[mine].argmax(1)
    return classes


def _outlines(ids, objects, palette, font):
    """Return the outlines of all objects in sight, with places for their names that keep apart."""
    out, colours = [], pictures.instance_colours(objects, palette)
    for k, thing in enumerate(objects):
        shape = pictures.outline(ids == k)
        if shape:
            path, (x, y), _ = shape
            out.append({'k': k, 'path': path, 'x': x, 'y': y, 'name': thing.category,
                        'colour': pictures.hex_colour(colours[k])})
    placed = []
    for item in sorted(out, key=lambda o: o['y']):
        half = 0.29 * font * len(item['name']) + 1
        item['x'] = float(np.clip(item['x'], half, max(half, ids.shape[1] - half)))
        y = max(item['y'], font)
        while any(abs(item['x'] - x) < half + h and abs(y - other) < 1.05 * font
                  for x, other, h in placed):
            y += 0.3 * font
        item['y'] = round(min(y, ids.shape[0] - 0.3 * font), 1)
        item['x'] = round(item['x'], 1)
        placed.append((item['x'], y, half))
    return out


def _rows(scene, scores, palette):
    """Return a row of the objects' table for every estimate."""
    by_estimate = {s.estimate: s for s in scores or () if s.estimate is not None}
    true = {t.category for t in scene.truth or ()}
    drawn = [i for i, o in enumerate(scene.objects) if o.category in scene.models]
    colours, rows = pictures.instance_colours(scene.objects, palette), []
    for i, thing in enumerate(scene.objects):
        score = by_estimate.get(i)
        verdict = None
        if scores is not None:
            verdict = ('ok' if score.localized else 'far') if score else (
                'extra' if thing.category in true else 'false')
        rows.append({
            'k': drawn.index(i) if i in drawn else -1, 'name': thing.category,
            'score': thing.score, 'at': [100 * x for x in thing.translation],
            'size': [100 * x for x in thing.size], 'verdict': verdict,
            'error_mm': 1000 * score.centre_m if score else None,
            'turn': float(np.degrees(score.rotation_rad)) if score else None,
            'colour': pictures.hex_colour(colours[i]),
            **(scene.evidence[i] if i < len(scene.evidence) else
               dict.fromkeys(('visible_ratio', 'residual_m', 'energy_delta', 'n_views')))})
    return rows


def _missed(scene, scores, palette):
    """Return the true objects that no estimate stands for."""
    return [{'name': s.category, 'at': [100 * x for x in scene.truth[s.truth].translation],
             'size': [100 * x for x in scene.truth[s.truth].size],
             'colour': pictures.hex_colour(palette[s.category])}
            for s in scores or () if s.estimate is None]


def _rejected(scene, palette):
    """Return the best rejected candidates, at most two a category."""
    out, count = [], {}
    for c in scene.rejected:
        count[c.category] = count.get(c.category, 0) + 1
        if count[c.category] > 2 or len(out) >= MAX_REJECTED:
            continue
        gaps = [float(np.linalg.norm(np.subtract(t.translation, c.translation)))
                for t in scene.truth or () if t.category == c.category]
        out.append({'name': c.category, 'score': c.score, 'at': [100 * x for x in c.translation],
                    'gap_mm': 1000 * min(gaps) if gaps else None,
                    'colour': pictures.hex_colour(palette[c.category])})
    return out


def _shaded(drawn, meshes, true, true_meshes, scene, palette):
    """Return the shaded pictures: the estimate and, where it is known, the truth."""
    camera = scene.observation.views[0].camera
    out = []
    for title, objects, shapes in (('estimate', drawn, meshes), ('truth', true, true_meshes)):
        if title == 'truth' and scene.truth is None:
            continue
        rgb = shaded_picture(shapes, pictures.instance_colours(objects, palette), camera,
                             meshes + true_meshes)
        out.append({'title': title, 'uri': pictures.data_uri(rgb), 'height': rgb.shape[0],
                    'width': rgb.shape[1]})
    return out


def _mean(scenes):
    """Return the means of the paper's scores over annotated scenes, None without any."""
    annotated = [s for s in scenes if s['true']]
    if not annotated:
        return None
    return {key: sum(s[key] / s['true'] for s in annotated) / len(annotated)
            for key in ('found', 'localized', 'tight')} | {
        'false': sum(s['false'] for s in annotated) / len(annotated), 'scenes': len(annotated)}

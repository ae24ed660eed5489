# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The 3D view: its data say where things are; a browser shows, turns and picks them."""

import base64
from dataclasses import replace
import hashlib
import json
from pathlib import Path
import re

from hooc_perception.core.geometry import inverse, matrix_from_pose, project, transform
from hooc_perception.evaluation.errors import world_mesh
from hooc_perception.evaluation.report import page as page_module
from hooc_perception.evaluation.report.cloud import extent_of, PointGroup
from hooc_perception.evaluation.report.page import palette_of, write_report
from hooc_perception.evaluation.report.pictures import NOTHING
from hooc_perception.evaluation.report.scene import report_scene, ShownScene
from hooc_perception.evaluation.report.space import Space
import numpy as np
import pytest


@pytest.fixture
def page(scene, tmp_path):
    return write_report(tmp_path / 'report.html', [scene])


def data_of(page):
    """Return (data of the only frame set of the first scene, meshes) as the script reads them."""
    text = page.read_text()
    found = re.findall(r'<script type="application/json"[^>]*>(.*?)</script>', text, re.S)
    space = json.loads(found[0])
    step, = space.pop('steps')
    return step | space, json.loads(found[-1])


def numbers(text, kind):
    return np.frombuffer(base64.b64decode(text), kind)


def test_models_stand_where_the_results_say(page, scene):
    data, meshes = data_of(page)
    assert [o['name'] for o in data['objects']] == [o.category for o in scene.objects]
    assert len(data['truth']) == len(scene.truth)
    for thing, given in zip(data['objects'], scene.objects):
        mesh, at = meshes[thing['mesh']], np.array(thing['at'])
        local = (numbers(mesh['v'], '<u2').reshape(-1, 3) / 65535 - 0.5) * mesh['extents']
        world = local @ at[:9].reshape(3, 3) + at[9:]
        vertices, faces = world_mesh(given, scene.models[given.category])
        np.testing.assert_allclose(world, vertices, atol=1e-5)
        np.testing.assert_array_equal(numbers(mesh['f'], '<u2').reshape(-1, 3), faces)


def test_an_object_is_drawn_with_the_mesh_that_was_found(scene, tmp_path):
    category = scene.objects[0].category
    other = next(m for name, m in scene.models.items() if name != category)
    family = replace(scene.models[category], variants=(replace(other, name=category),))
    things = [replace(scene.objects[0], member=k) for k in (0, 1, 7)]
    changed = replace(scene, objects=tuple(things), evidence=(), truth=tuple(things[:1]),
                      models={**scene.models, category: family})
    data, meshes = data_of(write_report(tmp_path / 'x.html', [changed]))
    # A model that does not have the mesh: the generic one takes its place.
    assert [o['mesh'] for o in data['objects']] == [category, f'{category}/1', category]
    assert data['truth'][0]['mesh'] == category
    for thing, given, shape in zip(data['objects'], things, (family, other, family)):
        at = np.array(thing['at'])
        mesh = meshes[thing['mesh']]
        np.testing.assert_allclose(mesh['extents'], shape.extents)
        local = (numbers(mesh['v'], '<u2').reshape(-1, 3) / 65535 - 0.5) * mesh['extents']
        np.testing.assert_allclose(local @ at[:9].reshape(3, 3) + at[9:],
                                   world_mesh(given, shape)[0], atol=1e-5)


def points_of(cloud):
    """Return {(camera, kind): (n, 3) points}."""
    points = numbers(cloud['p'], '<u2').reshape(-1, 3) / 65535 * cloud['span'] + cloud['low']
    counts = [group['n'] for group in cloud['groups']]
    assert sum(counts) == len(points) == len(numbers(cloud['rgb'], 'u1')) / 3
    return {(group['camera'], group['kind']): part for group, part in zip(
        cloud['groups'], np.split(points, np.cumsum(counts)[:-1]))}


def test_points_are_the_measured_ones_in_their_groups(page, scene):
    groups = points_of(data_of(page)[0]['cloud'])
    T = matrix_from_pose(scene.truth[-1].translation, scene.truth[-1].rotation_xyzw)
    for view in scene.observation.views:
        table, explained, left = (groups.pop((view.camera.name, kind))
                                  for kind in ('table', 'explained', 'unexplained'))
        assert len(table) > 100 and len(explained) > 100 and len(left) > 30
        assert np.median(np.abs(table[:, 2])) < 0.01
        # What is left unexplained is the object that was taken away.
        local = (left - T[:3, 3]) @ T[:3, :3]
        inside = (np.abs(local) < 0.5 * np.array(scene.truth[-1].size) + 0.02).all(1)
        assert inside.mean() > 0.7
        # These are readings of this camera.
        u, v = project(view.camera.K, transform(inverse(view.camera.T_world_camera), explained))
        assert view.foreground[np.round(v).astype(int), np.round(u).astype(int)].mean() > 0.9
    assert not groups


def test_cameras_and_table_are_where_they_are(page, scene):
    data = data_of(page)[0]
    for drawn, view in zip(data['cameras'], scene.observation.views, strict=True):
        camera, points = view.camera, np.array(drawn['frustum'])
        assert drawn['name'] == camera.name
        np.testing.assert_allclose(points[0], camera.T_world_camera[:3, 3])
        u, v = project(camera.K, transform(inverse(camera.T_world_camera), points[1:]))
        np.testing.assert_allclose(u, np.array([0, 1, 1, 0]) * camera.width - 0.5)
        np.testing.assert_allclose(v, np.array([0, 0, 1, 1]) * camera.height - 0.5)
    assert data['table']['z'] == 0
    for thing in scene.objects:
        x, y, _ = thing.translation
        assert data['table']['low'][0] < x < data['table']['high'][0]
        assert data['table']['low'][1] < y < data['table']['high'][1]


def test_things_of_no_category_are_told_apart(tiny, models, truth_results, tmp_path):
    entry = truth_results['scenes'][0] | {'unknown': [
        {'score': 0.5, 'translation': [0.2, 0.1, 0.05], 'rotation_xyzw': [0, 0, 0, 1],
         'size': [0.1, 0.2, 0.1]}]}
    seen = report_scene(entry, tiny.scene('10_1').depth(), models)
    data, meshes = data_of(write_report(tmp_path / 'x.html', [seen]))
    assert [o['unknown'] for o in data['objects']] == [False, False, False, True]
    last = data['objects'][-1]
    assert len(set(last['colour'])) == 1
    np.testing.assert_allclose(last['at'], [0.1, 0, 0, 0, 0.2, 0, 0, 0, 0.1, 0.2, 0.1, 0.05])
    assert meshes[last['mesh']]['extents'] == [1, 1, 1]


def test_the_first_view_shows_everything(page, scene):
    data = data_of(page)[0]
    space = Space.of([ShownScene.of(scene)], palette_of([scene]))
    np.testing.assert_allclose(space.view.eye, data['view']['eye'])
    camera = space.view.camera((1600, 900))
    shown = np.concatenate([*points_of(data['cloud']).values(),
                            *(world_mesh(o, scene.models[o.category])[0] for o in scene.objects)])
    local = transform(inverse(camera.T_world_camera), shown)
    u, v = project(camera.K, local)
    assert (local[:, 2] > data['view']['near']).all() and (u > 0).all() and (u < 1600).all()
    assert (v > 0).all() and (v < 900).all() and np.ptp(u) > 800
    # The picture for browsers without WebGL is of the same view.
    still = space.still()
    assert still.shape == (450, 800, 3)
    assert 0.05 < (still != NOTHING).any(-1).mean() < 0.95
    for k, thing in enumerate(scene.objects):
        (x,), (y,) = project(space.view.camera((800, 450)).K, transform(
            inverse(camera.T_world_camera), np.array([thing.translation])))
        near = still[int(y) - 6:int(y) + 7, int(x) - 6:int(x) + 7].reshape(-1, 3).astype(float)
        hue = near / np.maximum(np.linalg.norm(near, axis=1, keepdims=True), 1)
        mine = np.array(space.steps[0].colours[k], float)
        mine /= np.linalg.norm(mine)
        assert (hue @ mine > 0.99).any()


def test_the_box_of_a_scene_holds_objects_but_not_the_room():
    rng = np.random.default_rng(0)
    near = PointGroup('a', 'unexplained', rng.uniform(-0.3, 0.3, (900, 3)), np.zeros((900, 3)))
    wall = PointGroup('a', 'unexplained', rng.uniform(3, 5, (300, 3)), np.zeros((300, 3)))
    table = PointGroup('a', 'table', rng.uniform(-9, 9, (900, 3)), np.zeros((900, 3)))
    lost = PointGroup('b', 'explained', np.full((4, 3), np.nan), np.zeros((4, 3)))
    mesh = np.array([[-0.1, -0.1, 0], [0.1, 0.1, 0.2], [0.1, 0.9, 0.2]]), np.zeros((0, 3))
    low, high = extent_of([near, wall, table, lost], [mesh])
    assert (low < [-0.28, -0.28, -0.28]).all() and (low > -0.5).all()
    np.testing.assert_allclose(high, [0.7, 1.5, 0.72])
    low, high = extent_of([lost, table], [(np.full((4, 3), np.inf), np.zeros((0, 3)))])
    assert np.isfinite([low, high]).all() and (low < high).all()


def test_three_js_is_the_file_that_its_note_describes(page):
    folder = Path(page_module.__file__).parent / 'three'
    script, note = (folder / 'three.min.js').read_bytes(), (folder / 'README.md').read_text()
    assert f'`{hashlib.sha256(script).hexdigest()}`' in note
    version = json.loads((folder / 'package.json').read_text())['devDependencies']['three']
    assert f'three.js](https://threejs.org) {version} ' in note
    assert (folder / 'LICENSE').read_text() in page.read_text()


def test_names_cannot_end_the_script(scene, tmp_path):
    bad = '</script><b>x'
    thing, model = scene.objects[0], scene.models[scene.objects[0].category]
    changed = replace(scene, objects=(replace(thing, category=bad),), truth=None,
                      models={bad: replace(model, name=bad)}, evidence=({},))
    text = write_report(tmp_path / 'x.html', [replace(changed, evidence=())]).read_text()
    assert bad not in text
    assert data_of(tmp_path / 'x.html')[0]['objects'][0]['name'] == bad


def test_an_empty_scene_has_a_view_too(tiny, models, tmp_path):
    empty = report_scene({'scene': 'bare', 'objects': [], 'energy': None, 'seconds': None},
                         tiny.scene('nobody').depth(), models)
    data, _ = data_of(write_report(tmp_path / 'x.html', [empty]))
    assert data['objects'] == [] and np.isfinite(data['cloud']['low']).all()
    assert np.isfinite([*data['view']['eye'], data['view']['near'], data['view']['far']]).all()


def test_in_a_browser(page, scene, browser_module, tmp_path):
    """Turn, pick an object, read its numbers; nothing is fetched, nothing complains."""
    if not browser_module.find():
        pytest.skip('no Chromium is installed')
    canvas = 'document.querySelector(".space canvas")'
    view = 'document.querySelector(".space").view'
    with browser_module.Browser(tmp_path / 'profile') as browser:
        browser.open(page)
        browser.evaluate(f'{canvas}.scrollIntoView({{block: "center"}})')
        browser.until(f'!!{view}')

        def place(point):
            """Return where a point of the canvas is in the window."""
            left, top = browser.evaluate(f'(r => [r.left, r.top])({canvas}'
                                         '.getBoundingClientRect())')
            return left + point[0], top + point[1]

        first = browser.picture(canvas)
        assert (first != first[0, 0]).any(-1).mean() > 0.05
        # An object of its colour is where its centre is projected to.
        seen = 0
        for k, thing in enumerate(scene.objects):
            x, y = browser.evaluate(f'{view}.project({view}.objects[{k}].middle)')
            browser.click(*place((x, y)))
            picked = browser.evaluate(f'{view}.picked')
            if picked != k:
                continue        # another stands in front
            seen += 1
            text = browser.evaluate('document.querySelector(".facts").innerText')
            assert thing.category in text
            at = ' '.join(f'{100 * v:.1f}' for v in thing.translation)
            assert at in text and ('4.0 mm' in text) == (k == 0)
            assert browser.evaluate('document.querySelector("tr.picked").dataset.k') == str(k)
        assert seen >= 1
        browser.evaluate('document.querySelector("tr[data-k=\'1\']").click()')
        assert browser.evaluate(f'{view}.picked') == 1
        # The sky has no objects.
        browser.click(*place((5, 5)))
        assert browser.evaluate(f'{view}.picked') is None
        assert browser.evaluate('document.querySelector(".facts").hidden')
        before = browser.picture(canvas)
        np.testing.assert_array_equal(before, first)
        browser.drag(place((300, 200)), place((420, 240)))
        turned = browser.picture(canvas)
        assert (turned != first).any(-1).mean() > 0.05
        # From farther away, so that the cameras are in the picture.
        browser.evaluate(f'{view}.controls.dollyOut(0.3)')
        for name in ('measured', 'models', 'unexplained', 'names', 'truth', 'table', 'cameras',
                     'left', 'right'):
            shown = browser.picture(canvas)
            browser.evaluate(f'document.querySelector(".space input[name={name}]").click()')
            assert (browser.picture(canvas) != shown).any(), name
            browser.evaluate(f'document.querySelector(".space input[name={name}]").click()')
        # Double-click takes the view back.
        browser.evaluate(f'{canvas}.dispatchEvent(new MouseEvent("dblclick"))')
        for name in ('names', 'truth'):
            assert not browser.evaluate(
                f'document.querySelector(".space input[name={name}]").checked')
        np.testing.assert_array_equal(browser.picture(canvas), first)
        assert browser.errors == []
        assert all(url.startswith(('file:', 'data:')) for url in browser.requests)
        assert len(browser.requests) >= 1


def test_without_webgl_a_still_picture_remains(page, browser_module, tmp_path):
    if not browser_module.find():
        pytest.skip('no Chromium is installed')
    with browser_module.Browser(tmp_path / 'profile') as browser:
        browser.call('Page.addScriptToEvaluateOnNewDocument', source="""
            const get = HTMLCanvasElement.prototype.getContext;
            HTMLCanvasElement.prototype.getContext = function (kind, ...more) {
                return kind.startsWith('webgl') ? null : get.call(this, kind, ...more); };""")
        browser.open(page)
        assert 'no WebGL' in browser.evaluate('document.querySelector(".hint").innerText')
        assert browser.evaluate('document.querySelector(".space canvas").offsetParent === null')
        assert browser.evaluate('document.querySelector(".still").naturalWidth') == 800

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The 3D view: its data say where things are; a browser shows, turns and picks them."""

import base64
from dataclasses import replace
import importlib.util
import json
from pathlib import Path
import re

from hooc_perception.core.geometry import matrix_from_pose
from hooc_perception.evaluation.errors import world_mesh
from hooc_perception.evaluation.report.page import write_report
from hooc_perception.evaluation.report.scene import report_scene
import numpy as np
import pytest


@pytest.fixture(scope='module')
def browser_module():
    """Return browser.py."""
    spec = importlib.util.spec_from_file_location('browser',
                                                  Path(__file__).with_name('browser.py'))
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def page(scene, tmp_path):
    return write_report(tmp_path / 'report.html', [scene])


def data_of(page):
    """Return (data of the first scene, meshes) as the script reads them."""
    text = page.read_text()
    found = re.findall(r'<script type="application/json"[^>]*>(.*?)</script>', text, re.S)
    return json.loads(found[0]), json.loads(found[-1])


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


def test_points_are_the_measured_ones_in_their_groups(page, scene):
    cloud = data_of(page)[0]['cloud']
    points = numbers(cloud['p'], '<u2').reshape(-1, 3) / 65535 * cloud['span'] + cloud['low']
    assert sum(cloud['n']) == len(points) == len(numbers(cloud['rgb'], 'u1')) / 3
    table, explained, left = np.split(points, np.cumsum(cloud['n'])[:-1])
    assert len(table) > 100 and len(explained) > 100 and len(left) > 30
    assert np.median(np.abs(table[:, 2])) < 0.01
    # What is left unexplained is the object that was taken away.
    T = matrix_from_pose(scene.truth[-1].translation, scene.truth[-1].rotation_xyzw)
    local = (left - T[:3, 3]) @ T[:3, :3]
    inside = (np.abs(local) < 0.5 * np.array(scene.truth[-1].size) + 0.02).all(1)
    assert inside.mean() > 0.7


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
        for name in ('measured', 'models', 'unexplained', 'names', 'truth'):
            shown = browser.picture(canvas)
            browser.evaluate(f'document.querySelector(".space input[name={name}]").click()')
            assert (browser.picture(canvas) != shown).any(), name
        assert browser.errors == []
        assert all(url.startswith(('file:', 'data:')) for url in browser.requests)
        assert len(browser.requests) >= 1

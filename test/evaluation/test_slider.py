# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Sequences in the report: every frame set with its objects and events, one at a time."""

from dataclasses import replace
import json
import re
import shutil

from hooc_perception.cli.main import main
from hooc_perception.evaluation.report.cloud import MAX_SEQUENCE, PointGroup, thinned
from hooc_perception.evaluation.report.page import report_html, write_report
from hooc_perception.evaluation.report.sequence import in_sequences, ReportSequence, scenes_of
from hooc_perception.io.scenes.sequences import RecordedSequence
import numpy as np
import pytest

STAMP_NS = 1_700_000_000_123_456_789


@pytest.fixture
def steps(scene):
    """Return three frame sets: an object with id 1 stays, one with id 7 is moved, then taken."""
    stays, moves = (replace(o, id=number) for o, number in zip(scene.objects, (1, 7)))
    assert stays.category != moves.category
    there = moves.translation + [0, 0.12, 0]
    moved = {'event': 'moved', 'id': 7, 'category': moves.category,
             'translation': there.tolist(), 'before': moves.translation.tolist()}
    taken = {'event': 'taken', 'id': 7, 'category': moves.category, 'translation': there.tolist()}
    seen = (((stays, moves), ()), ((replace(moves, translation=there), stays), (moved,)),
            ((stays,), (taken,)))
    return tuple(replace(scene, name=f'set_{k}', objects=objects, events=events, evidence=(),
                         stamp_ns=STAMP_NS + k * 500_000_000)
                 for k, (objects, events) in enumerate(seen))


@pytest.fixture
def sequence(steps):
    return ReportSequence('clearing', steps, {2: 'removed box'})


def spaces(html):
    """Return the data of the 3D views of a page."""
    found = re.findall(r'<script type="application/json">(.*?)</script>', html, re.S)
    return [json.loads(text) for text in found]


def told(html):
    """Return the text beside each frame set, without tags."""
    blocks = re.findall(r'<div class="step".*?(?=<div class="step"|</section>)', html, re.S)
    return [' '.join(re.sub('<[^>]+>', ' ', block).split()) for block in blocks]


def test_the_page_holds_every_frame_set(sequence):
    html = report_html([sequence])
    space, = spaces(html)
    assert [[o['id'] for o in step['objects']] for step in space['steps']] == [
        [1, 7], [7, 1], [1]]
    assert all(sum(g['n'] for g in step['cloud']['groups']) > 100 for step in space['steps'])
    assert all(len(step['truth']) == len(sequence.steps[0].truth) for step in space['steps'])
    stays, moves = (o.category for o in sequence.steps[0].objects)
    first, second, third = told(html)
    assert 'no event' in first and f'{stays} 1 1.00' in first and f'{moves} 7 1.00' in first
    assert f'moved {moves} 7 by 12.0 cm' in second
    assert f'taken {moves} 7' in third and f'{moves} 7 1.00' not in third and 'missed' in third
    assert 'Known: removed box' in third and 'Known' not in first
    assert 'frame set 2 of 3 · set_1 · stamp 1700000000.623456789 s · +0.50 s' in html
    assert html.count('type="range"') == 1 and 'max="3"' in html
    # The overview leads to each frame set.
    assert re.findall(r'href="(#s0&amp;step=\d)"', html) == [
        f'#s0&amp;step={k}' for k in (1, 2, 3)]


def test_a_category_keeps_its_colour_and_a_mesh_is_stored_once(sequence):
    html = report_html([sequence])
    steps = spaces(html)[0]['steps']
    colours = {}
    for step in steps:
        for thing in step['objects']:
            colours.setdefault(thing['id'], set()).add(tuple(thing['colour']))
    assert len(colours) == 2 and all(len(c) == 1 for c in colours.values())
    meshes = json.loads(re.search(r'id="space-meshes">(.*?)</script>', html, re.S)[1])
    assert sorted(meshes) == sorted({o['mesh'] for step in steps
                                     for o in (*step['objects'], *step['truth'])})


def test_a_second_instance_keeps_its_colour_while_the_order_changes(sequence):
    first = sequence.steps[0].objects[0]
    twins = replace(first, id=2), replace(first, id=3, translation=first.translation + 0.1)
    steps = tuple(replace(sequence.steps[0], objects=order) for order in (twins, twins[::-1]))
    given, turned = (step['objects'] for step in spaces(
        report_html([replace(sequence, steps=steps)]))[0]['steps'])
    assert given[0]['colour'] != given[1]['colour']
    assert [o['colour'] for o in given] == [o['colour'] for o in turned[::-1]]


def test_where_nobody_tells_events_none_are_shown(sequence):
    steps = tuple(replace(s, events=None, stamp_ns=None, truth=None) for s in sequence.steps)
    html = report_html([replace(sequence, steps=steps, known={})])
    assert 'class="events"' not in html and 'no event' not in html and 'stamp' not in told(html)[0]
    assert len(spaces(html)[0]['steps']) == 3


def test_names_are_escaped(sequence):
    bad = '</script><b>x'
    thing = sequence.steps[0].objects[0]
    steps = tuple(replace(s, name=bad, objects=(replace(thing, category=bad),), truth=None,
                          models={bad: s.models[thing.category]},
                          events=({'event': bad, 'id': 1, 'category': bad},))
                  for s in sequence.steps)
    html = report_html([ReportSequence(bad, steps, {0: bad})], bad)
    assert bad not in html and '<b>x' not in html
    assert spaces(html)[0]['steps'][0]['objects'][0]['name'] == bad


def test_a_sequence_takes_the_place_of_its_scenes(steps, scene):
    told = RecordedSequence('clearing', 0.5, ('set_0', 'lost', 'set_1', 'set_2'),
                            {1: 'arm in', 3: 'removed box'})
    other = replace(scene, name='other')
    shown = in_sequences([other, steps[2], steps[0], steps[1]], [told])
    assert shown[0] is other and len(shown) == 2
    assert shown[1].steps == steps and shown[1].known == {2: 'removed box'}
    assert scenes_of(shown) == [other, *steps]
    # A single frame set is a scene like others, without a slider.
    assert in_sequences([steps[1]], [told]) == [steps[1]]
    assert 'type="range"' not in report_html([steps[1]])


def test_clouds_are_thinned_to_what_a_page_can_hold():
    rng = np.random.default_rng(0)
    points = rng.uniform(0, 0.6, (200_000, 3)) * [1, 1, 0]
    group = PointGroup('a', 'explained', points, np.zeros((len(points), 3)))
    thin, voxel_m = thinned([[group]] * 8)
    assert 8 * 1000 < sum(len(g.points) for step in thin for g in step) <= MAX_SEQUENCE
    kept = thin[0][0].points
    cells = np.floor(kept / voxel_m).astype(int)
    assert len(np.unique(cells, axis=0)) == len(kept)
    assert {tuple(p) for p in kept[:50]} <= {tuple(p) for p in points}


def test_results_of_a_set_with_sequences_have_a_slider(tiny_path, truth_results, tmp_path, capsys):
    folder = tmp_path / 'set'
    shutil.copytree(tiny_path, folder)
    (folder / 'sequences.yaml').write_text(
        '- {name: clearing, scenes: ["10_1", "10_2"], events: {1: removed ball}}\n')
    event = {'event': 'taken', 'id': 4, 'category': 'ball', 'translation': [0.1, 0, 0.04]}
    truth_results['scenes'][1] |= {'events': [event], 'stamp_ns': 100_000_000}
    results, page = tmp_path / 'r.json', tmp_path / 'r.html'
    results.write_text(json.dumps(truth_results))
    command = ['report', str(results), '--set', str(folder), '--out', str(page)]
    assert main(command) == 0
    html = page.read_text()
    assert [len(space['steps']) for space in spaces(html)] == [2, 1]
    assert 'taken ball 4' in told(html)[1] and 'Known: removed ball' in told(html)[1]
    # One frame set by itself has all pictures.
    assert main([*command, '--scene', '10_2']) == 0
    assert 'type="range"' not in page.read_text() and 'rendered depth' in page.read_text()
    truth_results['scenes'][1]['events'] = [event | {'id': 'x'}]
    results.write_text(json.dumps(truth_results))
    assert main(command) == 1
    assert 'scene 10_2: events[0] id' in capsys.readouterr().err


def test_in_a_browser(sequence, browser_module, tmp_path):
    """Slider, keys, button and address show one frame set each; nothing complains."""
    if not browser_module.find():
        pytest.skip('no Chromium is installed')
    page = write_report(tmp_path / 'report.html', [sequence])
    canvas = 'document.querySelector(".space canvas")'
    view = 'document.querySelector(".space").view'
    shown = '[...document.querySelectorAll(".step")].map(s => !s.hidden).indexOf(true) + 1'
    with browser_module.Browser(tmp_path / 'profile') as browser:
        def key(name):
            for kind in ('keyDown', 'keyUp'):
                browser.call('Input.dispatchKeyEvent', type=kind, key=name, code=name)

        def step():
            assert browser.evaluate('document.querySelector(".when").textContent').startswith(
                f'frame set {browser.evaluate(shown)} of 3')
            return browser.evaluate(shown), browser.evaluate('location.hash')

        browser.open(page)
        browser.evaluate(f'{canvas}.scrollIntoView({{block: "center"}})')
        browser.until(f'!!{view}')
        assert step() == (1, '')
        first = browser.picture(canvas)
        browser.evaluate(f'{view}.pick(0)')
        key('ArrowRight')
        assert step() == (2, '#step=2')
        # The same object, now in another row, is still picked.
        assert browser.evaluate(f'{view}.objects[{view}.picked].id') == 1
        assert browser.evaluate('[...document.querySelectorAll("tr.picked")]'
                                '.find(row => !row.closest("[hidden]")).dataset.k') == '1'
        browser.evaluate(f'{view}.pick(null)')
        assert (browser.picture(canvas) != first).any()
        browser.evaluate(f'{canvas}.focus()')
        key('ArrowLeft')
        assert step() == (1, '#step=1')
        key('ArrowLeft')
        assert step() == (1, '#step=1')
        np.testing.assert_array_equal(browser.picture(canvas), first)
        box = browser.evaluate('(r => [r.left, r.top, r.width, r.height])(document.querySelector('
                               '".slider").getBoundingClientRect())')
        browser.click(box[0] + box[2] - 3, box[1] + box[3] / 2)
        assert step() == (3, '#step=3')
        assert browser.evaluate(f'{view}.objects.length') == 1
        browser.evaluate('location.hash = "#step=2"')
        browser.until(f'{shown} === 2')
        browser.evaluate('document.querySelector(".play").click()')
        browser.until(f'{shown} === 3')
        assert browser.evaluate('document.querySelector(".play").getAttribute("aria-label")'
                                ) == 'Play'
        assert browser.errors == []


def test_the_address_says_which_frame_set_is_shown_at_first(sequence, browser_module, tmp_path):
    if not browser_module.find():
        pytest.skip('no Chromium is installed')
    page = write_report(tmp_path / 'report.html', [sequence, sequence])
    chosen = ('[...document.querySelectorAll(".sequence")].map('
              's => [...s.querySelectorAll(".step")].findIndex(step => !step.hidden) + 1)')
    with browser_module.Browser(tmp_path / 'profile') as browser:
        for address, expected in (('step=3', [3, 3]), ('s1&step=2', [1, 2]), ('step=9', [3, 3]),
                                  ('step=', [1, 1])):
            browser.call('Page.navigate', url='about:blank')
            browser.call('Page.navigate', url=f'{page.resolve().as_uri()}#{address}')
            browser.until('document.readyState === "complete" && location.protocol === "file:"')
            assert browser.evaluate(chosen) == expected
            browser.until('!document.querySelector(".space").view || '
                          f'document.querySelector(".space").view.step === '
                          'document.querySelector(".space").view.data.steps['
                          f'{expected[0] - 1}]')

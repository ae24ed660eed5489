# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The page stands on its own, shows every scene, and its pictures are pictures."""

import base64
from html.parser import HTMLParser
import io
import re

from hooc_perception.core.types import Candidates, PixelProbabilities
from hooc_perception.evaluation.report.page import report_html, write_report
from hooc_perception.evaluation.report.pictures import colours, outline, residual_picture
from hooc_perception.evaluation.report.scene import report_scene
from hooc_perception.evaluation.report.views import window
import numpy as np
from PIL import Image
import pytest


class Page(HTMLParser):
    """Collects tags, references and text."""

    VOID = {'meta', 'img', 'input', 'br', 'link'}

    def __init__(self, html):
        super().__init__()
        self.references, self.open, self.text, self.tags = [], [], [], []
        self.feed(html)

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag not in self.VOID:
            self.open.append(tag)
        for key, value in attrs:
            if key in ('src', 'href', 'xlink:href', 'srcset', 'action', 'poster', 'data'):
                self.references.append(value)

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)
        if tag not in self.VOID:
            self.open.pop()

    def handle_endtag(self, tag):
        assert self.open and self.open.pop() == tag, f'stray </{tag}>'

    def handle_data(self, data):
        self.text.append(data)


@pytest.fixture
def scenes(tiny, models, truth_results):
    """Return two scenes: one with everything, one with the results alone."""
    first, second = tiny.scene('10_1'), tiny.scene('10_2')
    entries = {e['scene']: e for e in truth_results['scenes']}
    entries['10_1']['objects'][1]['translation'][0] += 0.2
    entries['10_1']['objects'].pop(2)
    full = entries['10_1'] | {'stage_seconds': {'parse': 0.7}, 'converged': False}
    full['objects'][0] |= {'visible_ratio': 0.8, 'residual_m': 0.004, 'energy_delta': 0.1,
                           'n_views': 2}
    v, u = np.mgrid[50:70, 60:90].reshape(2, -1)
    p = np.zeros((len(u), 4), np.uint8)
    p[:, 1] = 255
    probabilities = PixelProbabilities(np.zeros(len(u), np.uint8),
                                       np.stack([u, v], 1).astype(np.uint16), p)
    pool = Candidates(np.array([1, 3], np.uint16),
                      np.array([full['objects'][0]['translation'], [0.3, 0.3, 0.1]]),
                      np.tile([0, 0, 0, 1.0], (2, 1)), np.full((2, 3), 0.1, np.float32),
                      np.array([0.5, 0.25], np.float32))
    return [report_scene(full, first.depth(), models, first.truth, probabilities, pool),
            report_scene(entries['10_2'], second.depth(), tuple(models.values()))]


@pytest.fixture
def html(scenes):
    return report_html(scenes, 'A <b>title</b>', ['profile & seed'])


def test_page_is_self_contained(html):
    page = Page(html)
    assert page.open == []
    assert len(page.references) > 10
    for reference in page.references:
        assert reference.startswith(('data:image/png;base64,', '#')), reference[:60]
    # three.js names one paper and one XML namespace; it has nothing that could load a file.
    viewer, = re.findall(r'<script>\n(/\*! three\.js\n.*?)</script>', html, re.S)
    assert len(re.findall(r'https?://', viewer)) == 2 and 'w3.org/1999/xhtml' in viewer
    for word in ('fetch(', 'XMLHttpRequest', 'import(', 'importScripts', '@import', '.src='):
        assert word not in viewer, word
    own = html.replace(viewer, '').replace('http://www.w3.org/2000/svg', '')
    for word in ('http://', 'https://', '//cdn', '@import', 'url(', 'fetch('):
        assert word not in own, word
    assert len(html) < 3_000_000


def test_every_picture_decodes_and_shows_something(html):
    pictures = [r for r in Page(html).references if r.startswith('data:')]
    # Views x (measured, labels, explained, residual), a pair, a still; views x 3, one, a still.
    assert len(pictures) == 2 * 4 + 2 + 1 + 2 * 3 + 1 + 1
    spread = []
    for reference in pictures:
        image = Image.open(io.BytesIO(base64.b64decode(reference.split(',', 1)[1])))
        image.load()
        assert image.format == 'PNG' and min(image.size) > 30
        spread.append(np.asarray(image.convert('RGB')).std())
    # Only where the estimate is the truth itself is there nothing to see in the residuals.
    assert sum(s < 2 for s in spread) == 2


def test_scenes_objects_and_verdicts_are_told(html):
    text = ' '.join(' '.join(Page(html).text).split())
    for word in ('10_1', '10_2', 'ball', 'can', 'too far off', 'missed', 'stopped at its deadline',
                 'Rejected candidates', 'most likely class', 'profile & seed', '200 mm', '80 %'):
        assert word in text, word
    assert '<b>title</b>' not in html


def test_rejected_candidates_are_those_not_chosen(scenes):
    assert [c.category for c in scenes[0].rejected] == ['can']
    assert scenes[1].rejected == [] and scenes[1].scores is None


def test_outlines_follow_the_objects(html, tiny):
    marks = [a for tag, a in Page(html).tags if tag == 'g' and a.get('class') == 'mark']
    assert {a['data-k'] for a in marks} == {'0', '1'}


def test_empty_scene_and_empty_page(tiny, models):
    empty = report_scene({'scene': 'bare', 'objects': [], 'energy': None, 'seconds': None},
                         tiny.scene('nobody').depth(), models)
    assert 'No objects were found' in report_html([empty])
    assert Page(report_html([])).open == []


def test_report_goes_to_a_file_or_a_folder(scenes, tmp_path):
    assert write_report(tmp_path / 'x.html', scenes[1:]) == tmp_path / 'x.html'
    path = write_report(tmp_path / 'folder', scenes[1:])
    assert path == tmp_path / 'folder' / 'report.html'
    assert path.read_text().startswith('<!DOCTYPE html>')


def test_outline_of_a_square_with_a_hole():
    mask = np.zeros((40, 40), bool)
    mask[10:30, 10:30] = True
    mask[18:22, 18:22] = False
    path, (x, y), area = outline(mask)
    assert path.count('M') == 2 and area == mask.sum()
    assert mask[int(y), int(x)]
    assert outline(np.zeros((4, 4), bool)) is None


def test_residual_is_red_where_something_unexplained_stands():
    measured, explained = np.full((1, 3), 1.0), np.array([[1.05, 1.0, 0.95]])
    (red, neutral, blue), = residual_picture(measured, explained).astype(int)
    assert red[0] > red[2] + 50 and blue[2] > blue[0] + 50
    assert abs(neutral[0] - neutral[2]) < 10


def test_window_keeps_the_shape_and_the_mask(tiny):
    camera = tiny.cameras[0]
    mask = np.zeros((camera.height, camera.width), bool)
    mask[40:60, 100:158] = True
    rows, columns = window(mask, camera)
    assert rows.start <= 40 and rows.stop >= 60
    assert columns.start <= 100 and columns.stop >= 158
    height, width = rows.stop - rows.start, columns.stop - columns.start
    assert width / height == pytest.approx(camera.width / camera.height, rel=0.05)


def test_categories_have_colours_of_their_own():
    palette = colours([f'c{i}' for i in range(25)])
    rgb = np.array(list(palette.values()), float)
    gap = np.linalg.norm(rgb[:, None] - rgb[None], axis=-1) + 999 * np.eye(25)
    assert gap.min() > 12


def test_things_of_no_category_are_no_false_categories(tiny, models, truth_results):
    entry, scene = truth_results['scenes'][0], tiny.scene('10_1')
    unknown = {'unknown': [{'score': 0.5, 'translation': [0.2, 0.1, 0.05],
                            'rotation_xyzw': [0, 0, 0, 1], 'size': [0.1, 0.2, 0.1]}]}
    alone, beside = (' '.join(' '.join(Page(report_html([report_scene(
        entry | more, scene.depth(), models, scene.truth)], 'x')).text).split())
        for more in ({}, unknown))
    n = len(entry['objects'])
    for text in (alone, beside):
        assert 'false categories 0' in text and f'{n} object' in text
    assert '1 of no category' in beside and 'of no category' not in alone

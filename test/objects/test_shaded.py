# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Shaded pictures: both renderers show the thing where the depth renderer says it is."""

from hooc_perception.core.render import render_depth
from hooc_perception.objects import shaded
from hooc_perception.objects.contact_sheet import contact_sheet
from hooc_perception.objects.shaded import Orbit, render_shaded
import numpy as np
import pytest
import trimesh

BOX = trimesh.creation.box((0.1, 0.2, 0.05))
SIZE = (120, 90)


@pytest.fixture(params=['gl', 'numpy'])
def renderer(request, monkeypatch):
    shaded._pyrender.cache_clear()
    if request.param == 'numpy':
        monkeypatch.setenv('HOOC_NO_GL', '1')
    elif shaded._pyrender() is None:
        pytest.skip('neither EGL nor OSMesa is installed')
    yield request.param
    shaded._pyrender.cache_clear()


def test_the_thing_is_where_the_depth_renderer_sees_it(renderer):
    camera = Orbit().camera(BOX.vertices, SIZE)
    picture = render_shaded([BOX], camera)
    assert picture.shape == (90, 120, 3) and picture.dtype == np.uint8
    drawn = (picture != 255).any(axis=-1)
    seen = render_depth([(np.asarray(BOX.vertices), np.asarray(BOX.faces, np.int32))],
                        camera)[1] == 0
    assert (drawn & seen).sum() / (drawn | seen).sum() > 0.95


def test_faces_differ_in_brightness(renderer):
    picture = render_shaded([BOX], Orbit(), SIZE)
    levels = np.unique(picture[(picture != 255).any(-1)].mean(-1).round(-1))
    assert len(levels) >= 3


def test_colour_is_the_one_asked_for(renderer):
    picture = render_shaded([BOX], Orbit(), SIZE, [(230, 40, 30)]).astype(int)
    drawn = (picture != 255).any(-1)
    assert (picture[drawn][:, 0] > picture[drawn][:, 2] + 20).mean() > 0.95


def test_nearer_mesh_hides_the_other(renderer):
    wall = trimesh.creation.box((0.3, 0.3, 0.001))
    wall.apply_translation((0, 0, 0.2))
    picture = render_shaded([BOX, wall], Orbit(elevation_deg=89.9), SIZE,
                            [(255, 0, 0), (0, 0, 255)]).astype(int)
    drawn = (picture != 255).any(-1)
    assert (picture[drawn][:, 2] > picture[drawn][:, 0]).mean() > 0.95


def test_orbit_fits_everything(renderer):
    for mesh in (BOX, trimesh.creation.cylinder(0.002, 1.0), trimesh.creation.icosphere(2, 3.0)):
        picture = render_shaded([mesh], Orbit(10.0, 60.0), SIZE)
        drawn = (picture != 255).any(-1)
        assert drawn.any() and not (drawn[0].any() or drawn[-1].any() or drawn[:, 0].any()
                                    or drawn[:, -1].any())


def test_nothing_gives_an_empty_picture(renderer):
    assert (render_shaded([], Orbit(), SIZE, background=(10, 20, 30)) == (10, 20, 30)).all()


def test_contact_sheet_has_a_cell_for_each(monkeypatch):
    monkeypatch.setenv('HOOC_NO_GL', '1')
    shaded._pyrender.cache_clear()
    sheet = contact_sheet({'a': BOX, 'b': BOX, 'c': BOX}, columns=2, cell=(80, 60))
    shaded._pyrender.cache_clear()
    pixels = np.array(sheet)
    assert sheet.size == (160, 168)
    cells = [pixels[:60, :80], pixels[:60, 80:], pixels[84:144, :80]]
    assert all((cell != 255).any() for cell in cells)
    assert (pixels[84:, 80:] == 255).all()

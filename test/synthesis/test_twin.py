# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

import cv2
from hooc_perception.cli.main import main
from hooc_perception.core.geometry import inverse, transform
from hooc_perception.core.render import render_depth
from hooc_perception.errors import HoocError
from hooc_perception.io.scenes.scene_set import load_scene_set
from hooc_perception.synthesis import twin
from hooc_perception.synthesis.raw_views import Caster, undistorted_rays
import numpy as np
import pytest
import trimesh


def simple_catalogue():
    """Return builders of five things, two of which are of glass."""
    return {'box': lambda: trimesh.creation.box((0.18, 0.12, 0.06)),
            'can': lambda: trimesh.creation.cylinder(0.035, 0.11, sections=24),
            'glass': lambda: trimesh.creation.annulus(0.03, 0.034, 0.1, sections=24),
            'jug': lambda: trimesh.creation.annulus(0.05, 0.055, 0.18, sections=24),
            'plate': lambda: trimesh.creation.cylinder(0.1, 0.012, sections=24)}


@pytest.fixture
def small(monkeypatch):
    """Make the twin quick: five simple categories, two scenes of four and five objects."""
    monkeypatch.setattr(twin, 'CATALOGUE', simple_catalogue())
    monkeypatch.setattr(twin, 'SCENES', {'a': 4, 'b': 5})


def contents(folder):
    """Return {relative path: bytes} of all files."""
    return {p.relative_to(folder).as_posix(): p.read_bytes()
            for p in sorted(folder.rglob('*')) if p.is_file()}


def world_points(view):
    """Return (H, W, 3) world points of a raw view by the camera's written calibration."""
    points = undistorted_rays(view.camera) * view.depth[..., None]
    return transform(view.camera.T_world_camera, points)


def test_the_same_seed_gives_the_same_bytes_and_a_chosen_scene_is_the_full_sets(small, tmp_path):
    whole = contents(twin.write_twin(tmp_path / 'whole', 7))
    one = contents(twin.write_twin(tmp_path / 'one', 7, twin.TwinOptions(scenes=('b',))))
    # Written apart, every file of the smaller set is a file of the whole one, byte by byte.
    assert len([k for k in one if k.startswith('scenes/')]) == 4
    assert one == {k: v for k, v in whole.items() if not k.startswith('scenes/a/')}
    other = contents(twin.write_twin(tmp_path / 'other', 8, twin.TwinOptions(scenes=('b',))))
    assert other['scenes/b/kinect1.png'] != whole['scenes/b/kinect1.png']


def test_what_is_written_reads_back_and_fits_its_truth(small, tmp_path):
    loaded = load_scene_set(twin.write_twin(tmp_path / 'set', 1))
    assert loaded.max_instances == 1
    assert loaded.category_names == tuple(simple_catalogue())
    assert [c.name for c in loaded.cameras] == ['kinect1', 'kinect2', 'kinect3']
    assert [len(s.truth) for s in loaded.scenes] == [4, 5]
    meshes = {c.name: trimesh.load(c.mesh_path) for c in loaded.categories}
    for scene in loaded.scenes:
        assert len({t.category for t in scene.truth}) == len(scene.truth)
        views = scene.depth()
        points = np.concatenate([p[np.isfinite(p[..., 2])] for p in map(world_points, views)])
        for t in scene.truth:
            assert twin.LEAST_VISIBLE <= t.surface_visibility <= 1
            ratio = t.size / meshes[t.category].extents
            assert np.all((ratio > 0.5) & (ratio < 2.0))
            # Measured points lie in the object's own box.
            R = trimesh.transformations.quaternion_matrix(
                np.asarray(t.rotation_xyzw)[[3, 0, 1, 2]])[:3, :3]
            local = (points - t.translation) @ R
            assert (np.abs(local) < 0.5 * np.asarray(t.size) + 0.004).all(axis=1).sum() > 60


def test_the_table_stands_at_zero_but_for_calibration_and_noise(small, tmp_path):
    scene, = load_scene_set(twin.write_twin(
        tmp_path / 'set', 2, twin.TwinOptions(scenes=('a',)))).scenes
    for view in scene.depth():
        assert view.depth.shape == (424, 512)
        z = world_points(view)[..., 2]
        table = z[np.abs(z) < 0.03]
        assert table.size > 30000
        assert abs(np.median(table)) < 0.010
        assert np.median(np.abs(table - np.median(table))) < 0.004


def test_rig_stands_about_at_the_corners_of_an_equilateral_triangle():
    rig = twin.kinect_rig(np.random.default_rng(0))
    at = np.array([c.T_world_camera[:3, 3] for c in rig])
    sides = [np.linalg.norm(at[i] - at[i - 1]) for i in range(3)]
    assert max(sides) / min(sides) < 1.5
    for camera in rig:
        origin = transform(inverse(camera.T_world_camera), np.zeros((1, 3)))[0]
        assert abs(origin[0] / origin[2]) < 0.15 and 0.9 < origin[2] < 1.4
        assert np.abs(camera.D).max() > 0.2


def test_options_change_the_rig_and_allow_repeats(small, tmp_path, monkeypatch):
    monkeypatch.setattr(twin, 'SCENES', {'many': 8})
    loaded = load_scene_set(twin.write_twin(
        tmp_path / 'set', 0, twin.TwinOptions(cameras=2, repeat=True)))
    assert len(loaded.cameras) == 2 and loaded.max_instances == 0
    names = [t.category for t in loaded.scenes[0].truth]
    assert len(names) == 8 > len(set(names))


def test_rays_invert_the_lens_as_opencv_distorts():
    camera = twin.kinect_rig(np.random.default_rng(3))[0]
    rays = undistorted_rays(camera)
    pixels, _ = cv2.projectPoints(rays.reshape(-1, 3), np.zeros(3), np.zeros(3), camera.K,
                                  camera.D)
    v, u = np.mgrid[:424, :512]
    np.testing.assert_allclose(pixels.reshape(424, 512, 2), np.stack([u, v], -1), atol=1e-3)


def test_cast_views_agree_with_the_renderer(cameras):
    ball = trimesh.creation.icosphere(3, 0.1)
    ball.apply_translation([0.05, 0, 0.1])
    camera = cameras[0]
    depth, ids, normals = Caster([(ball.vertices, ball.faces)]).view(camera)
    expected, own = render_depth([(np.array(ball.vertices), ball.faces.astype(np.int32))], camera)
    both = (ids == 0) & (own == 0)
    assert both.sum() > 1000 and ((ids == 0) ^ (own == 0)).sum() < 20
    np.testing.assert_allclose(depth[both], expected[both], atol=2e-5)
    assert np.isinf(depth[ids < 0]).all()
    # Normals face the camera.
    assert np.all(np.sum(normals * undistorted_rays(camera), -1)[both] <= 1e-6)


def test_a_lens_does_not_move_what_lies_in_its_middle(cameras):
    bent = replace(cameras[0], D=np.array([0.09, -0.27, 0, 0, 0.09]))
    straight, curved = undistorted_rays(cameras[0]), undistorted_rays(bent)
    np.testing.assert_allclose(straight[205:218, 250:262], curved[205:218, 250:262], atol=1e-4)
    assert np.abs(straight[0, 0] - curved[0, 0]).max() > 0.03


def test_seen_points_are_those_in_front(cameras):
    box = trimesh.creation.box((0.2, 0.2, 0.2))
    points, faces = trimesh.sample.sample_surface(box, 2000, seed=0)
    seen = Caster([(box.vertices, box.faces)]).seen(points, cameras)
    for k, camera in enumerate(cameras):
        # A convex body hides exactly the faces that are turned away.
        towards = camera.T_world_camera[:3, 3] - points
        facing = np.sum(box.face_normals[faces] * towards, axis=1) > 0
        assert (seen[:, k] == facing).mean() > 0.99


def test_wrong_options_are_refused():
    with pytest.raises(HoocError, match="no scene '99_9'"):
        twin.TwinOptions(scenes=('99_9',))
    with pytest.raises(HoocError, match='0 cameras'):
        twin.TwinOptions(cameras=0)
    for strength in (-0.1, 2.1, float('nan'), float('inf')):
        with pytest.raises(HoocError, match='the strength is .* from 0 to 2'):
            twin.TwinOptions(strength=strength)


def test_a_set_is_not_written_over_another(small, tmp_path):
    (tmp_path / 'set').mkdir()
    (tmp_path / 'set' / 'mine.txt').write_text('keep')
    with pytest.raises(HoocError, match='in use'):
        twin.write_twin(tmp_path / 'set')


def test_the_command_writes_a_scene_of_the_real_catalogue(tmp_path):
    assert not main(['twin', '--out', str(tmp_path / 'set'), '--scene', '10_1'])
    loaded = load_scene_set(tmp_path / 'set')
    assert len(loaded.categories) == 25
    scene, = loaded.scenes
    assert len({t.category for t in scene.truth}) == 10
    # Table 1 of the paper: about .4 to .7 of most objects' surface is seen by some camera.
    assert 0.35 < np.median([t.surface_visibility for t in scene.truth]) < 0.8

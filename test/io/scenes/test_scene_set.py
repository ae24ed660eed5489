# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Scene sets: what is written is read back, and the sets beside the repository are read."""

from hooc_perception.core.types import Camera
from hooc_perception.errors import HoocError
from hooc_perception.io.scenes.png import write_png
from hooc_perception.io.scenes.scene_set import (
    load_scene_set,
    NewScene,
    TrueObject,
    write_scene_set,
)
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
import trimesh
import yaml


def camera(name, rng, width=40, height=30):
    K = np.array([[50.0, 0, 19.5], [0, 51.0, 14.5], [0, 0, 1]])
    T_world_camera = np.eye(4)
    down = Rotation.from_euler('x', 180, degrees=True)
    T_world_camera[:3, :3] = (down * Rotation.from_rotvec(0.1 * rng.normal(size=3))).as_matrix()
    T_world_camera[:3, 3] = 0.1 * rng.normal(size=3) + [0, 0, 1]
    return Camera(name, width, height, K, rng.normal(size=5) * 0.01, T_world_camera)


@pytest.fixture
def rng():
    return np.random.default_rng(3)


@pytest.fixture
def written(tmp_path, rng):
    """Return (path, cameras, scenes) of a small set with everything that the format knows."""
    cameras = tuple(camera(name, rng) for name in ('left', 'right'))
    meshes = {'ball': trimesh.creation.icosphere(1, 0.04),
              'box': trimesh.creation.box((0.1, 0.2, 0.05))}
    truth = (TrueObject('box', rng.normal(size=3), Rotation.random(None, rng).as_quat(),
                        np.array([0.1, 0.2, 0.06]), 0.5),
             TrueObject('ball', rng.normal(size=3), np.array([0, 0, 0, 1.0]), np.full(3, 0.08)))

    def depth():
        image = np.round(rng.uniform(0.5, 3, (30, 40)), 3)
        image[rng.random(image.shape) < 0.1] = np.nan
        return image

    labels = {'right': rng.integers(0, 4, (30, 40)).astype(np.uint8)}
    scenes = (NewScene('a', (depth(), depth()), truth),
              NewScene('b', (depth(), depth()), None, labels,
                       tuple(camera(name, rng) for name in ('left', 'right'))))
    path = write_scene_set(tmp_path / 'set', 'small', meshes, cameras, iter(scenes), 1)
    return path, cameras, scenes


def assert_same_camera(a, b):
    assert (a.name, a.width, a.height, a.distortion_model) == (
        b.name, b.width, b.height, b.distortion_model)
    np.testing.assert_array_equal(a.K, b.K)
    np.testing.assert_array_equal(a.D, b.D)
    np.testing.assert_allclose(a.T_world_camera, b.T_world_camera, atol=1e-12)


def test_what_is_written_is_read_back(written):
    path, cameras, scenes = written
    loaded = load_scene_set(path)
    assert (loaded.name, loaded.world_frame, loaded.max_instances) == ('small', 'table', 1)
    assert loaded.category_names == ('ball', 'box')
    assert trimesh.load(loaded.categories[1].mesh_path).extents == pytest.approx((0.1, 0.2, 0.05))
    assert [scene.name for scene in loaded.scenes] == ['a', 'b']
    for new, scene in zip(scenes, loaded.scenes):
        for view, depth, expected in zip(scene.depth(), new.depth, new.cameras or cameras):
            assert view.depth.dtype == np.float32
            np.testing.assert_allclose(view.depth, depth, atol=1e-6)
            assert_same_camera(view.camera, expected)
    assert loaded.scenes[0].labels() is None
    np.testing.assert_array_equal(loaded.scenes[1].labels()['right'], scenes[1].labels['right'])
    assert loaded.scenes[1].truth is None
    for read, true in zip(loaded.scenes[0].truth, scenes[0].truth):
        assert (read.category, read.surface_visibility) == (true.category, true.surface_visibility)
        for field in ('translation', 'rotation_xyzw', 'size'):
            np.testing.assert_allclose(getattr(read, field), getattr(true, field), atol=1e-12)


def test_a_category_may_have_several_meshes(written):
    path, _, _ = written
    file = path / 'dataset.yaml'
    content = yaml.safe_load(file.read_text())
    content['categories'] = [
        {'name': 'ball', 'model': 'models/ball.ply'},
        {'name': 'thing', 'models': ['models/box.ply', 'models/ball.ply'], 'scale': 0.5},
        {'name': 'box', 'models': ['models/box.ply']}]
    file.write_text(yaml.safe_dump(content))
    (path / 'scenes' / 'a' / 'ground_truth.yaml').unlink()
    ball, thing, box = load_scene_set(path).categories
    models = path / 'models'
    assert (ball.mesh_path, ball.variant_paths) == (models / 'ball.ply', ())
    assert (box.mesh_path, box.variant_paths) == (models / 'box.ply', ())
    assert (thing.mesh_path, thing.variant_paths, thing.scale) == (
        models / 'box.ply', (models / 'ball.ply',), 0.5)


def test_cameras_of_the_first_scene_serve_a_set_without_its_own(written):
    path, _, scenes = written
    (path / 'cameras.yaml').unlink()
    (path / 'scenes' / 'a').rename(path / 'scenes' / 'c')
    own = (path / 'scenes' / 'b' / 'cameras.yaml').read_text()
    (path / 'scenes' / 'c' / 'cameras.yaml').write_text(own)
    for with_scenes in (True, False):
        loaded = load_scene_set(path, with_scenes=with_scenes)
        assert_same_camera(loaded.cameras[0], scenes[1].cameras[0])


def test_a_scene_may_correct_one_camera_of_the_set(written):
    path, cameras, scenes = written
    file = path / 'scenes' / 'b' / 'cameras.yaml'
    entries = yaml.safe_load(file.read_text())
    file.write_text(yaml.safe_dump({'right': entries['right']}))
    left, right = load_scene_set(path).scene('b').cameras
    assert_same_camera(left, cameras[0])
    assert_same_camera(right, scenes[1].cameras[1])


def test_training_does_not_look_into_scenes(written):
    path, _, _ = written
    for file in (path / 'scenes').rglob('*'):
        if file.is_file():
            file.write_bytes(b'junk')
    loaded = load_scene_set(path, with_scenes=False)
    assert loaded.scenes == ()
    assert len(loaded.cameras) == 2


def test_numbers_that_yaml_takes_for_text(written):
    path, _, _ = written
    file = path / 'cameras.yaml'
    entries = yaml.safe_load(file.read_text())
    entries['left']['D'] = ['1e-3', '-2e-05', 0, 0, 0]
    file.write_text(yaml.safe_dump(entries))
    np.testing.assert_array_equal(load_scene_set(path).cameras[0].D, [1e-3, -2e-5, 0, 0, 0])


def test_scenes_by_name(written):
    loaded = load_scene_set(written[0])
    assert [scene.name for scene in loaded.selected(['b', 'a']).scenes] == ['b', 'a']
    assert loaded.selected([]) is loaded


@pytest.mark.parametrize('folder, scenes, truth', [('dev', 9, True), ('osd', 23, False)])
def test_the_sets_beside_the_repository(shared_scenes, folder, scenes, truth):
    loaded = load_scene_set(shared_scenes / folder)
    assert len(loaded.scenes) == scenes
    scene = loaded.scenes[0]
    assert (scene.truth is not None) == truth
    assert (scene.labels() is None) == truth
    for view in scene.depth():
        assert 0.3 < np.nanmedian(view.depth) < 3


def test_what_a_mask_image_covers_is_hidden(written):
    path, cameras, scenes = written
    mask = np.zeros((30, 40), np.uint8)
    mask[5:9, 10:20] = 200
    write_png(path / 'scenes' / 'a' / 'left_mask.png', mask)
    left, right = load_scene_set(path).scenes[0].depth()
    np.testing.assert_array_equal(left.hidden, mask > 0)
    assert np.isnan(left.depth[mask > 0]).all() and right.hidden is None
    np.testing.assert_allclose(left.depth[mask == 0], scenes[0].depth[0][mask == 0], atol=1e-6)
    write_png(path / 'scenes' / 'a' / 'left_mask.png', mask[:-1])
    with pytest.raises(HoocError, match='left_mask.png: the image has 40 x 29 pixels'):
        load_scene_set(path).scenes[0].depth()

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""BOP datasets: a small one written here by BOP's own definitions, and real frames."""

import json

import cv2
from hooc_perception.core.geometry import inverse, matrix_from_pose, transform
from hooc_perception.core.render import render_depth
from hooc_perception.core.types import Camera
from hooc_perception.errors import HoocError
from hooc_perception.io.scenes.scene_set import load_scene_set
from hooc_perception.objects.mesh import load_mesh
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
import trimesh

K = np.array([[150.0, 0, 79.5], [0, 150, 59.5], [0, 0, 1]])
# The models' origins are off the centres of their bounding boxes, as in many datasets.
MODELS = {3: ((100, 60, 40), (30, -20, 15)), 7: ((80, 80, 120), (0, 0, 60))}


def looking_at(eye):
    """Return T_world_camera of an upright camera that looks at the origin."""
    z = -np.array(eye, float) / np.linalg.norm(eye)
    x = np.cross(z, [0, 0, 1.0])
    x /= np.linalg.norm(x)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = np.stack([x, np.cross(z, x), z], 1), eye
    return T


def pose(rotation_vector, translation):
    T = np.eye(4)
    T[:3, :3] = Rotation.from_rotvec(rotation_vector).as_matrix()
    T[:3, 3] = translation
    return T


# Model frame to the table's: what stands 10 cm left and right of the middle.
T_TABLE_MODEL = {3: pose([0, 0, 0.4], [-0.13, 0.02, 0.005]), 7: pose([0, 0, 1], [0.1, 0, 0])}


def mesh_mm(obj_id):
    extents, centre = MODELS[obj_id]
    mesh = trimesh.creation.box(extents)
    mesh.apply_translation(centre)
    return mesh


@pytest.fixture
def dataset(tmp_path):
    """Return a BOP folder: scene 2 with world poses, scene 5 with one image without."""
    path = tmp_path / 'bop'
    (path / 'models').mkdir(parents=True)
    info = {}
    for obj_id in MODELS:
        mesh = mesh_mm(obj_id)
        mesh.export(path / 'models' / f'obj_{obj_id:06d}.ply')
        info[obj_id] = {**{f'min_{a}': v for a, v in zip('xyz', mesh.bounds[0])},
                        **{f'size_{a}': v for a, v in zip('xyz', mesh.extents)}}
    info[7]['name'] = 'tall_box'
    (path / 'models' / 'models_info.json').write_text(json.dumps(info))
    T_source_table = pose([0.3, 2, -0.7], [1, 2, 3])
    eyes = {1: (0, -0.6, 0.5), 4: (0.5, 0.3, 0.5)}
    write_scene(path / 'test' / '000002', eyes, T_source_table)
    write_scene(path / 'test' / '000005', {1: (0, -0.6, 0.5)}, None)
    return path


def write_scene(folder, eyes, T_source_table):
    (folder / 'depth').mkdir(parents=True)
    table = trimesh.creation.box((1.2, 1.2, 0.02))
    meshes = [(table.vertices - [0, 0, 0.01], table.faces.astype(np.int32))]
    for obj_id, T in T_TABLE_MODEL.items():
        mesh = mesh_mm(obj_id)
        meshes.append((transform(T, mesh.vertices * 0.001), mesh.faces.astype(np.int32)))
    cameras, truth = {}, {}
    for image, eye in eyes.items():
        T_table_camera = looking_at(eye)
        depth, _ = render_depth(meshes, Camera('c', 160, 120, K, np.zeros(5), T_table_camera))
        counts = np.where(np.isfinite(depth), depth * 10000, 0).round().astype(np.uint16)
        cv2.imwrite(str(folder / 'depth' / f'{image:06d}.png'), counts)
        cameras[image] = {'cam_K': K.ravel().tolist(), 'depth_scale': 0.1}
        if T_source_table is not None:
            T_w2c = inverse(T_source_table @ T_table_camera)
            cameras[image] |= {'cam_R_w2c': T_w2c[:3, :3].ravel().tolist(),
                               'cam_t_w2c': (1000 * T_w2c[:3, 3]).tolist()}
        T_m2c = {i: inverse(T_table_camera) @ T for i, T in T_TABLE_MODEL.items()}
        truth[image] = [{'obj_id': i, 'cam_R_m2c': T[:3, :3].ravel().tolist(),
                         'cam_t_m2c': (1000 * T[:3, 3]).tolist()} for i, T in T_m2c.items()]
    (folder / 'scene_camera.json').write_text(json.dumps(cameras))
    (folder / 'scene_gt.json').write_text(json.dumps(truth))


def test_categories_and_scenes(dataset):
    loaded = load_scene_set(dataset)
    assert (loaded.name, loaded.world_frame, loaded.max_instances) == ('bop', 'table', 0)
    assert loaded.category_names == ('obj_000003', 'tall_box')
    assert [c.scale for c in loaded.categories] == [0.001, 0.001]
    assert [s.name for s in loaded.scenes] == ['000002', '000005_000001']
    assert [c.name for c in loaded.scenes[0].cameras] == ['view_000001', 'view_000004']
    assert [c.name for c in loaded.scenes[1].cameras] == ['camera']
    assert (loaded.cameras[0].width, loaded.cameras[0].height) == (160, 120)


def test_poses_come_in_the_table_frame(dataset):
    for scene in load_scene_set(dataset).scenes:
        truth = {true.category: true for true in scene.truth}
        for obj_id, name in ((3, 'obj_000003'), (7, 'tall_box')):
            true = truth[name]
            extents, centre = MODELS[obj_id]
            np.testing.assert_allclose(true.size, np.array(extents) / 1000, atol=1e-9)
            expected = transform(T_TABLE_MODEL[obj_id], np.array([centre]) / 1000)[0]
            assert true.translation[2] == pytest.approx(expected[2], abs=0.002)
            up = matrix_from_pose(true.translation, true.rotation_xyzw)[:3, 2]
            np.testing.assert_allclose(up, [0, 0, 1], atol=0.01)
        apart = truth['tall_box'].translation - truth['obj_000003'].translation
        expected = (transform(T_TABLE_MODEL[7], np.array([MODELS[7][1]]) / 1000)
                    - transform(T_TABLE_MODEL[3], np.array([MODELS[3][1]]) / 1000))
        assert np.linalg.norm(apart) == pytest.approx(np.linalg.norm(expected), abs=1e-6)
        # The origin lies under the middle of what is seen of both.
        assert np.linalg.norm(scene.truth[0].translation[:2]
                              + scene.truth[1].translation[:2]) / 2 < 0.05


def test_without_models_info_the_meshes_say_it(dataset):
    told = load_scene_set(dataset)
    file = dataset / 'models' / 'models_info.json'
    file.unlink()
    plain = load_scene_set(dataset)
    assert plain.category_names == ('obj_000003', 'obj_000007')
    for a, b in zip(told.scenes, plain.scenes):
        for one, other in zip(a.truth, b.truth):
            np.testing.assert_allclose(one.translation, other.translation, atol=1e-6)
            np.testing.assert_allclose(one.size, other.size, atol=1e-6)


def agreement(scene, loaded):
    """Return (object, |measured - rendered| (n,)) where true models are rendered."""
    mesh_of = {c.name: load_mesh(c.mesh_path, c.scale) for c in loaded.categories
               if c.name in {true.category for true in scene.truth}}
    meshes = [(transform(matrix_from_pose(true.translation, true.rotation_xyzw),
                         mesh_of[true.category].vertices),
               mesh_of[true.category].faces.astype(np.int32)) for true in scene.truth]
    for view in scene.depth():
        depth, ids = render_depth(meshes, view.camera)
        for i, true in enumerate(scene.truth):
            seen = (ids == i) & np.isfinite(view.depth)
            yield true.category, np.abs(view.depth - depth)[seen]


def test_true_models_agree_with_the_depth(dataset):
    loaded = load_scene_set(dataset)
    for scene in loaded.scenes:
        for _, residual in agreement(scene, loaded):
            assert len(residual) > 100
            assert np.quantile(residual, 0.95) < 0.0002


def test_true_models_agree_with_real_depth(shared_scenes):
    loaded = load_scene_set(shared_scenes / 'bop_ycbv')
    assert len(loaded.scenes) == 4
    for scene in loaded.scenes:
        for category, residual in agreement(scene, loaded):
            assert len(residual) > 1000, category
            assert np.median(residual) < 0.006, category
        assert scene.table.residual_m < 0.004
        for true in scene.truth:
            assert 0 < true.translation[2] < 0.2


def test_world_is_written_down(dataset):
    world = load_scene_set(dataset).scenes[0].world['world']
    assert json.loads(json.dumps(world))['estimated_from'] == 'dominant support plane'
    assert len(world['table_from_source']['rotation_xyzw']) == 4


def test_without_truth(dataset):
    (dataset / 'test' / '000005' / 'scene_gt.json').unlink()
    assert load_scene_set(dataset).scenes[1].truth is None


def test_models_and_cameras_alone(dataset):
    loaded = load_scene_set(dataset, with_scenes=False)
    assert loaded.scenes == ()
    assert [c.name for c in loaded.cameras] == ['view_000001', 'view_000004']


def test_many_views_are_thinned(dataset, monkeypatch):
    monkeypatch.setattr('hooc_perception.io.scenes.bop_layout.MAX_VIEWS', 1)
    assert len(load_scene_set(dataset).scenes[0].cameras) == 1


def edit_json(file, change):
    content = json.loads(file.read_text())
    change(content)
    file.write_text(json.dumps(content))


ERRORS = [
    ('test/000002/scene_camera.json', lambda c: c['1'].pop('cam_K'), ('cam_K', 'missing')),
    ('test/000002/scene_camera.json', lambda c: c['1'].update(cam_K=[0] * 9), ('cam_K',)),
    ('test/000002/scene_camera.json', lambda c: c['1'].update(depth_scale=0), ('depth_scale',)),
    ('test/000002/scene_camera.json', lambda c: c['1'].update(cam_R_w2c=[1] * 9),
     ('cam_R_w2c', 'rotation')),
    ('test/000002/scene_camera.json', lambda c: c.update(x={}), ('x', 'number')),
    ('test/000002/scene_gt.json', lambda t: t['1'].append({}), ('1', 'obj_id')),
    ('test/000002/scene_gt.json', lambda t: [o.pop('cam_t_m2c') for o in t['1']], ('cam_t_m2c',)),
    ('test/000002/scene_gt.json', lambda t: t['1'][0].update(obj_id=9), ('obj_id', '9')),
    ('test/000002/scene_gt.json', lambda t: t['1'][0].update(obj_id='a'), ('obj_id',)),
    ('test/000002/scene_gt.json', lambda t: t['1'][0].update(obj_id=[1]), ('obj_id',)),
    ('models/models_info.json', lambda m: m.pop('3'), ('3',)),
    ('models/models_info.json', lambda m: m['3'].pop('size_x'), ('size_x',)),
    ('models/models_info.json', lambda m: m['3'].update(name='tall_box'), ('tall_box', 'twice')),
    ('models/models_info.json', lambda m: m['3'].update(name='tall.box'),
     ('tall_box', 'tall.box', 'rename')),
]


@pytest.mark.parametrize('name, change, words', ERRORS,
                         ids=[f'{n.split("/")[-1]}-{"-".join(w)}' for n, _, w in ERRORS])
def test_errors_name_file_and_field(dataset, name, change, words):
    edit_json(dataset / name, change)
    with pytest.raises(HoocError) as error:
        load_scene_set(dataset)
    for word in (name.split('/')[-1], ';', *words):
        assert word in str(error.value)


def test_missing_image(dataset):
    (dataset / 'test' / '000002' / 'depth' / '000004.png').unlink()
    with pytest.raises(HoocError, match=r'000004\.png.*missing'):
        load_scene_set(dataset)


def several_sensors(dataset, posed=True):
    """Make scene 2 one of two sensors that took image 4 at once, and of one without depth."""
    folder = dataset / 'test' / '000002'
    files = {name: json.loads((folder / f'scene_{name}.json').read_text())
             for name in ('camera', 'gt')}
    for sensor, image in (('cam1', '1'), ('realsense', '4')):
        (folder / f'depth_{sensor}').mkdir()
        (folder / 'depth' / f'{int(image):06d}.png').rename(
            folder / f'depth_{sensor}' / '000004.png')
        for name, content in files.items():
            entry = content[image]
            if name == 'camera' and not posed:
                entry = {k: v for k, v in entry.items() if 'w2c' not in k}
            (folder / f'scene_{name}_{sensor}.json').write_text(json.dumps({'4': entry}))
    (folder / 'scene_camera_grey.json').write_text('{}')
    for name in ('depth', 'scene_camera.json', 'scene_gt.json'):
        (folder / name).rename(folder / f'old_{name}')
    return dataset


def test_images_that_several_sensors_took_at_once_are_one_scene(dataset):
    before = load_scene_set(dataset).scenes[0]
    several, single = load_scene_set(several_sensors(dataset)).scenes
    assert (several.name, single.name) == ('000002_000004', '000005_000001')
    assert [c.name for c in several.cameras] == ['cam1', 'realsense']
    assert len(several.depth()) == 2 and len(several.truth) == 2
    for camera, known in zip(several.source_cameras, before.source_cameras):
        np.testing.assert_array_equal(camera.T_world_camera, known.T_world_camera)
    assert [c.name for c in load_scene_set(dataset, with_scenes=False).cameras] == [
        'cam1', 'realsense']


def test_sensors_without_poses_give_scenes_of_their_own(dataset):
    names = [s.name for s in load_scene_set(several_sensors(dataset, posed=False)).scenes]
    assert names == ['000002_000004_cam1', '000002_000004_realsense', '000005_000001']


def test_a_scene_without_any_depth_is_refused(dataset):
    several_sensors(dataset)
    for sensor in ('cam1', 'realsense'):
        (dataset / 'test' / '000002' / f'depth_{sensor}').rename(dataset / f'depth_{sensor}')
    with pytest.raises(HoocError, match='no sensor has depth images .*depth_cam1.*; add'):
        load_scene_set(dataset)


def test_objects_whose_mesh_is_missing_belong_to_no_category(dataset):
    (dataset / 'models' / 'obj_000003.ply').unlink()
    loaded = load_scene_set(dataset)
    assert [true.category for true in loaded.scenes[0].truth] == ['tall_box']
    info = dataset / 'models' / 'models_info.json'
    info.write_text(json.dumps({'7': json.loads(info.read_text())['7']}))
    with pytest.raises(HoocError, match='obj_id is 3'):
        load_scene_set(dataset)

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""BOP's CSV against the ground truth that a BOP dataset brings."""

import csv
import json

from hooc_perception.core.geometry import inverse, matrix_from_pose, pose_from_matrix
from hooc_perception.evaluation.bop_csv import write_bop_csv
from hooc_perception.evaluation.evaluate import evaluate_results, scoring_models
from hooc_perception.io.scenes.scene_set import load_scene_set
import numpy as np
from scipy.spatial.transform import Rotation


def test_truth_comes_back_as_scene_gt_says(shared_scenes, tmp_path):
    path = shared_scenes / 'bop_ycbv'
    scene_set = load_scene_set(path)
    scenes = [{'scene': s.name, 'seconds': 0.5, 'objects': [
        {'category': t.category, 'score': 0.25, 'translation': t.translation,
         'rotation_xyzw': t.rotation_xyzw, 'size': t.size} for t in s.truth]}
        for s in scene_set.scenes]
    n = write_bop_csv(tmp_path / 'a.csv', {'scenes': scenes}, scene_set)
    with open(tmp_path / 'a.csv') as file:
        rows = list(csv.DictReader(file))
    assert n == len(rows) == sum(len(s.truth) for s in scene_set.scenes) > 10
    for row in rows:
        R, t = (np.array(row[k].split(), float) for k in 'Rt')
        truth = json.loads((path / 'test' / f'{int(row["scene_id"]):06d}' / 'scene_gt.json')
                           .read_text())[row['im_id']]
        assert min(np.abs(np.array(g['cam_R_m2c']) - R).max()
                   + np.abs(np.array(g['cam_t_m2c']) - t).max()
                   for g in truth if g['obj_id'] == int(row['obj_id'])) < 1e-4
        assert float(row['score']) == 0.25 and float(row['time']) == 0.5


def test_results_of_another_table_frame_are_brought_into_this_one(shared_scenes):
    scene_set = load_scene_set(shared_scenes / 'bop_ycbv').selected(['000051_000001'])
    (scene,), rng = scene_set.scenes, np.random.default_rng(0)
    T_other_source = matrix_from_pose(rng.normal(size=3), Rotation.random(None, rng).as_quat())
    T_other_ours = T_other_source @ inverse(scene.table.T_table_source)

    def placed(T, true):
        translation, rotation = pose_from_matrix(
            T @ matrix_from_pose(true.translation, true.rotation_xyzw))
        return {'category': true.category, 'score': 1.0, 'translation': translation.tolist(),
                'rotation_xyzw': rotation.tolist(), 'size': true.size.tolist()}

    translation, rotation = pose_from_matrix(T_other_source)
    entry = {'scene': scene.name, 'seconds': 1.0,
             'objects': [placed(T_other_ours, t) for t in scene.truth],
             'world': {'table_from_source': {'translation': translation,
                                             'rotation_xyzw': rotation}}}
    models = scoring_models(scene_set)
    (score,) = evaluate_results(scene_set, {'scenes': [entry]}, models).scores
    assert score.tight == 1 and max(o.centre_m for o in score.objects) < 1e-9
    del entry['world']
    (score,) = evaluate_results(scene_set, {'scenes': [entry]}, models).scores
    assert score.tight == 0


def test_own_sets_count_scenes_images_and_objects(tiny, truth_results, tmp_path):
    write_bop_csv(tmp_path / 'a.csv', truth_results, tiny)
    with open(tmp_path / 'a.csv') as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 2 * (3 + 2 + 3)
    assert {(r['scene_id'], r['im_id']) for r in rows} == {(s, i) for s in '123' for i in '01'}
    ball, true = rows[0], tiny.scene('10_1').truth[0]
    assert ball['obj_id'] == '1'
    camera = tiny.cameras[0]
    T = np.linalg.inv(camera.T_world_camera)
    np.testing.assert_allclose(np.array(ball['t'].split(), float),
                               1000 * (T[:3, :3] @ true.translation + T[:3, 3]), atol=1e-3)
    R = T[:3, :3] @ Rotation.from_quat(true.rotation_xyzw).as_matrix()
    np.testing.assert_allclose(np.array(ball['R'].split(), float), R.ravel(), atol=1e-6)

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Calibrations of Bouguet's toolbox, with OpenCV's projection as the oracle."""

import cv2
from hooc_perception.core.geometry import inverse, transform
from hooc_perception.errors import HoocError
from hooc_perception.io.scenes.bouguet import load_bouguet, upright
import numpy as np
import pytest
from scipy.io import savemat
from scipy.spatial.transform import Rotation

# The layout is that of the toolbox's own saving routine.
TEXT = """\
% Intrinsic and Extrinsic Camera Parameters
%
%-- Focal length:
fc = [ 657.395439316418745 ; 657.763141595273646 ];

%-- Principal point:
cc = [ 302.983775835675908 ; 242.616307467215154 ];

%-- Skew coefficient:
alpha_c = 0.000000000000000;

%-- Distortion coefficients:
kc = [ -0.255839642018540 ; 0.127600693790317 ; -0.000208233871105 ; 0.000033402480000 ; 0 ];

%-- Focal length uncertainty:
fc_error = [ 0.346822380489741 ; 0.371103846846014 ];

%-- Image size:
nx = 640;
ny = 480;

n_ima = 2;
est_fc = [ 1 ; 1 ];

%-- Image #1:
omc_1 = [ 1.654757e+00 ; 1.651872e+00 ; -6.699195e-01 ];
Tc_1  = [ -1.777897e+02 ; -8.383311e+01 ; 8.528546e+02 ];

%-- Image #2:
omc_2 = [ 1.849010e+00 ; 1.900569e+00 ; -3.971190e-01 ];
Tc_2  = [ -1.549112e+02 ; -1.594867e+02 ; 7.573217e+02 ];
"""
OM, T = np.array([1.849010, 1.900569, -0.3971190]), np.array([-154.9112, -159.4867, 757.3217])
K = np.array([[657.395439316418745, 0, 302.983775835675908],
              [0, 657.763141595273646, 242.616307467215154], [0, 0, 1]])
KC = np.array([-0.255839642018540, 0.127600693790317, -0.000208233871105, 0.000033402480, 0])


def variables(**changes):
    values = {'fc': K[[0, 1], [0, 1]][:, None], 'cc': K[:2, 2:], 'kc': KC[:, None],
              'alpha_c': 0.0, 'nx': 640.0, 'ny': 480.0, 'omc_2': OM[:, None], 'Tc_2': T[:, None],
              'Rc_2': Rotation.from_rotvec(OM).as_matrix(), 'I_1': np.zeros((4, 4), np.uint8),
              **changes}
    return {key: value for key, value in values.items() if value is not None}


def written(tmp_path, kind, **changes):
    file = tmp_path / f'Calib_Results.{kind}'
    if kind == 'm':
        file.write_text(TEXT)
    else:
        savemat(file, variables(**changes))
    return file


@pytest.mark.parametrize('kind', ['m', 'mat'])
def test_points_of_the_board_land_where_opencv_says(tmp_path, kind):
    camera = load_bouguet(written(tmp_path, kind), 'kinect1', '2')
    assert (camera.name, camera.width, camera.height) == ('kinect1', 640, 480)
    board = np.random.default_rng(0).uniform(0, 0.2, (20, 3)) * [1, 1, 0]
    expected, _ = cv2.projectPoints(board * 1000, OM, T, K, KC)
    in_camera = transform(inverse(camera.T_world_camera), board)
    found, _ = cv2.projectPoints(in_camera, np.zeros(3), np.zeros(3), camera.K, camera.D)
    np.testing.assert_allclose(found, expected, atol=1e-6)


@pytest.mark.parametrize('extrinsics', [{'R': Rotation.from_rotvec(OM).as_matrix(), 'T': T},
                                        {'om': OM, 'T': T}], ids=['R', 'om'])
def test_own_extrinsics_come_before_those_of_an_image(tmp_path, extrinsics):
    file = written(tmp_path, 'mat', **extrinsics, omc_2=None, Tc_2=None, Rc_2=None)
    T_camera_world = inverse(load_bouguet(file, 'a').T_world_camera)
    np.testing.assert_allclose(T_camera_world[:3, 3], T / 1000)
    np.testing.assert_allclose(T_camera_world[:3, :3], Rotation.from_rotvec(OM).as_matrix(),
                               atol=1e-12)


def test_stereo_pair(tmp_path):
    both = {f'{key}_{side}': value for side in ('left', 'right')
            for key, value in variables().items() if key in ('fc', 'cc', 'kc', 'alpha_c')}
    file = tmp_path / 'Calib_Results_stereo.mat'
    savemat(file, {**both, 'nx': 640, 'ny': 480, 'R': np.eye(3), 'T': [-100.0, 0, 0]})
    left, right = (load_bouguet(file, side, side) for side in ('left', 'right'))
    np.testing.assert_array_equal(left.T_world_camera, np.eye(4))
    np.testing.assert_allclose(right.T_world_camera[:3, 3], [0.1, 0, 0])


def test_skew_is_kept(tmp_path):
    camera = load_bouguet(written(tmp_path, 'mat', alpha_c=0.01), 'a', '2')
    assert camera.K[0, 1] == pytest.approx(0.01 * camera.K[0, 0]) and camera.K[0, 1] > 1


def test_unit_of_the_board(tmp_path):
    metres = load_bouguet(written(tmp_path, 'm'), 'a', '1', unit=1.0)
    inches = load_bouguet(written(tmp_path, 'm'), 'a', '1', unit=0.0254)
    np.testing.assert_allclose(inches.T_world_camera[:3, 3],
                               0.0254 * metres.T_world_camera[:3, 3])


def test_upright_turns_the_board_face_up(tmp_path):
    above = load_bouguet(written(tmp_path, 'm'), 'a', '2')
    assert above.T_world_camera[2, 3] > 0
    assert upright([above]) == (above,)
    # The same board, its corners clicked in the other order: z points into it.
    turned = Rotation.from_rotvec(OM) * Rotation.from_rotvec([np.pi, 0, 0])
    below = load_bouguet(written(tmp_path, 'mat', om=turned.as_rotvec(), T=T), 'a')
    assert below.T_world_camera[2, 3] < 0
    again, = upright([below])
    np.testing.assert_allclose(again.T_world_camera, above.T_world_camera, atol=1e-6)


@pytest.mark.parametrize('changes, word', [
    ({'fc': None}, 'fc'), ({'nx': None}, 'nx'), ({'ny': 0.0}, 'ny'), ({'fc': [1.0]}, 'fc'),
    ({'fc': [0.0, 600.0]}, 'fc'), ({'cc': [np.nan, 0]}, 'cc'), ({'kc': [1.0, 2]}, 'kc'),
    ({'alpha_c': 0.1}, 'alpha_c'), ({'omc_2': None, 'Rc_2': None}, 'omc_2'),
    ({'Tc_2': None}, 'Tc_2'), ({'Rc_2': np.ones((3, 3))}, 'Rc_2')],
    ids=lambda value: value if isinstance(value, str) else '')
def test_errors_name_file_and_field(tmp_path, changes, word):
    file = written(tmp_path, 'mat', **changes)
    with pytest.raises(HoocError, match=rf'Calib_Results\.mat: .*{word}.*;'):
        load_bouguet(file, 'a', '2')


@pytest.mark.parametrize('name, data', [('a.mat', b'junk'), ('a.mat', b''), ('a.m', b'\xff\xfe'),
                                        ('a.yaml', b'fc: 1')])
def test_files_that_are_none(tmp_path, name, data):
    (tmp_path / name).write_bytes(data)
    with pytest.raises(HoocError, match=f'{name}: .*;'):
        load_bouguet(tmp_path / name, 'a')


def test_matlab_code_is_not_run(tmp_path):
    file = tmp_path / 'Calib_Results.m'
    file.write_text(TEXT.replace('nx = 640;', 'nx = system(1);'))
    with pytest.raises(HoocError, match='nx'):
        load_bouguet(file, 'a', '1')

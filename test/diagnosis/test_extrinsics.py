# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The doctor says whether the cameras of a bag agree about what two of them see."""

from types import SimpleNamespace

from hooc_perception.diagnosis.bag import check_bag
from hooc_perception.diagnosis.finding import OK, WARNING
from hooc_perception.io.bags.writer import write_bag
import numpy as np


def written(tabletop, folder, stated, count=7):
    """Return the path of a bag of one scene whose cameras stand at `stated`."""
    true = tabletop.camera('left', 20), tabletop.camera('right', 75)
    views, = tabletop.scenes(true, stated(true), [3], count)
    scene = SimpleNamespace(name='s', cameras=stated(true), truth=None, world={},
                            depth_units=(0.001,) * 2, labels=lambda: None, depth=lambda: views)
    scene_set = SimpleNamespace(name='test', world_frame='table', category_names=('box',),
                                max_instances=1)
    return write_bag(scene, scene_set, folder, repeat=1)


def of_pair(path):
    """Return the one Finding on the pair of cameras."""
    finding, = (f for f in check_bag(path) if f.subject == 'left + right')
    return finding


def test_cameras_that_agree(tabletop, tmp_path):
    finding = of_pair(written(tabletop, tmp_path, lambda true: true))
    assert finding.level == OK and ' mm, ' in finding.text and 'degrees' in finding.text


def test_cameras_that_disagree_are_told_to_calibrate(tabletop, tmp_path):
    def stated(true):
        return true[0], tabletop.disturbed(true[1], np.random.default_rng(4), 1.5, 0.02)
    finding = of_pair(written(tabletop, tmp_path, stated))
    assert finding.level == WARNING and 'hooc calibrate' in finding.text


def test_a_bare_table_is_not_called_a_measurement_of_the_place(tabletop, tmp_path):
    finding = of_pair(written(tabletop, tmp_path, lambda true: true, count=0))
    assert finding.level == OK and 'height and tilt only' in finding.text

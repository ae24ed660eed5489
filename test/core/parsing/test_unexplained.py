# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What no object explains: every point of it, each with its reason."""

from hooc_perception.core.parsing.unexplained import Reason, reasons, unexplained
from hooc_perception.core.types import Candidates, UnknownObjects
from hooc_perception.objects.derive import derive
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
import trimesh

SIZE = np.array([0.12, 0.08, 0.20])


@pytest.fixture(scope='module')
def block():
    """Return the GenericModel of a block."""
    return derive('block', trimesh.creation.box(SIZE), np.random.default_rng(0), 800, 50)


def answer(x, y):
    """Return the Candidates of one upright block."""
    return Candidates(np.ones(1, np.uint16), np.array([[x, y, SIZE[2] / 2]]),
                      np.array([[0.0, 0, 0, 1]]), SIZE[None].astype(np.float32),
                      np.ones(1, np.float32))


def things(translation, size, yaw=0.0):
    """Return UnknownObjects with one box."""
    return UnknownObjects(np.array([translation]), Rotation.from_rotvec([[0, 0, yaw]]).as_quat(),
                          np.array([size], np.float32), np.ones(1, np.float32),
                          (np.zeros((0, 3)),))


@pytest.fixture(scope='module')
def seen(small):
    """Two blocks and a crumb on a table."""
    return small.observed([small.box([-0.2, 0.0, 0.1], SIZE), small.box([0.1, 0.1, 0.1], SIZE),
                           small.box([0.1, -0.2, 0.015], [0.03, 0.03, 0.03])])


def test_each_point_has_its_reason(seen, block):
    box = things([0.1, 0.1, 0.1], SIZE)
    left = unexplained(seen, answer(-0.2, 0.0), box, (block,))
    assert len(left.points) == len(left.reason) > 200
    of_box = np.abs(left.points[:, :2] - [0.1, 0.1]).max(1) < 0.08
    assert of_box.sum() > 100 and (left.reason[of_box] == Reason.UNKNOWN).mean() > 0.95
    crumb = np.linalg.norm(left.points[:, :2] - [0.1, -0.2], axis=1) < 0.04
    assert crumb.sum() > 10 and (left.reason[crumb] == Reason.NOISE).all()
    assert not (np.abs(left.points[:, :2] - [-0.2, 0.0]).max(1) < 0.03).any()


def test_what_lies_beside_an_object_is_its_residue(block):
    beside = np.array([[-0.2 + SIZE[0] / 2 + 0.005, 0.0, 0.1], [0.3, 0.3, 0.1]])
    got = reasons(beside, answer(-0.2, 0.0), UnknownObjects.empty(), (block,))
    assert got.tolist() == [Reason.RESIDUE, Reason.NOISE]


def test_boxes_are_turned():
    box = things([0.0, 0.0, 0.05], [0.2, 0.04, 0.1], yaw=np.pi / 2)
    along = np.array([[0.0, 0.09, 0.05], [0.09, 0.0, 0.05]])
    got = reasons(along, Candidates.empty(), box, ())
    assert got.tolist() == [Reason.UNKNOWN, Reason.NOISE]


def test_a_table_that_is_explained_leaves_nothing(small, block):
    observation = small.observed([small.box([-0.2, 0.0, 0.1], SIZE)])
    left = unexplained(observation, answer(-0.2, 0.0), UnknownObjects.empty(), (block,))
    assert len(left.points) < 30 and left.points.shape[1] == 3

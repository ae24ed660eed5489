# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Scores of hypotheses in the field against plain numpy; climbing never loses."""

from types import SimpleNamespace

from hooc_perception.core.hypotheses.kernels import drawing, refinement, scoring
from hooc_perception.core.hypotheses.kernels.records import (
    DrawSettings,
    FieldRefineSettings,
    ScoreWeights,
    Surface,
)
from hooc_perception.core.hypotheses.sampling import tables
from hooc_perception.core.kernels.pose import rotation_of
import numba
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

FREE, SHELL, PRIOR = 0.7, 0.6, 0.03
POINTS = 64
NO_EQUATIONS = np.empty((0, 0))
WEIGHTS = ScoreWeights(FREE, SHELL, PRIOR)


@pytest.fixture(scope='module')
def ground(desk):
    """Return the desk's field, the models' tables and some good and bad hypotheses."""
    space = desk.frame
    t, truth, rng = tables(desk.models), desk.truth, np.random.default_rng(5)
    rows, model_of = [], []
    for k in range(60):
        c = k % 3
        spread = (0.0, 0.004, 0.02, 0.1)[k // 15]
        q = (Rotation.from_rotvec(rng.normal(0, 8 * spread, 3))
             * Rotation.from_quat(truth.rotation_xyzw[c])).as_quat()
        rows.append(np.concatenate([truth.translation[c] + rng.normal(0, spread, 3), q,
                                    np.exp(rng.normal(0, 4 * spread, 3)).clip(0.5, 1.8)]))
        model_of.append(c)
    return SimpleNamespace(field=space.field, t=t, H=np.array(rows), model_of=np.array(model_of))


@numba.njit
def seed_kernels(seed):
    """Start the random numbers of compiled code, which has its own."""
    np.random.seed(seed)  # noqa: NPY002


def surface_of(ground, c):
    """Return the Surface of model c."""
    return Surface(ground.t.points[c], ground.t.normals[c])


def value(ground, h, c, n=POINTS):
    """Return the kernel's score of hypothesis `h` of model c."""
    return scoring.score(h, surface_of(ground, c), n, ground.field, WEIGHTS, np.empty((3, 3)),
                         NO_EQUATIONS)


def posed(ground, h, c, n=POINTS):
    """Return (points, normals) (n, 3) of a hypothesis in the world."""
    R = Rotation.from_quat(h[3:7]).as_matrix()
    normals = ground.t.normals[c][:n] / h[7:10]
    normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    return (ground.t.points[c][:n] * h[7:10]) @ R.T + h[:3], normals @ R.T


def voxel_of(ground, point):
    """Return the index of the voxel that holds a point, None outside of the field."""
    index = np.floor((point - ground.field.origin) / ground.field.voxel).astype(int)
    inside = (index >= 0).all() and (index < ground.field.data.shape[:3]).all()
    return tuple(index) if inside else None


def plain_evidence(ground, h, c):
    """Return (agree, violate, shell), point by point."""
    agree = violate = shell = 0.0
    for point, normal in zip(*posed(ground, h, c)):
        at = voxel_of(ground, point)
        if point[2] < -0.010:
            violate += 1.0
            continue
        if at is None:
            violate += 0.7
            continue
        distance, free, *coded = ground.field.data[at][:5].astype(float)
        if distance > 100:
            violate += free / 255 * min(1.0, (distance - 100) / 100)
        if distance < 255:
            facing = normal @ (np.array(coded) - 128) / 127
            agree += (1 - (distance / 255) ** 2) * np.clip(facing, 0, 1)
        at = voxel_of(ground, point + scoring.SHELL_M * normal)
        if at is not None:
            shell += max(0.0, 1 - float(ground.field.data[at][0]) / 90)
    return agree, violate, shell


def test_evidence_is_that_of_plain_numpy(ground):
    seen = []
    for h, c in zip(ground.H, ground.model_of):
        found = scoring.field_evidence(h, surface_of(ground, c), 0, POINTS, ground.field,
                                       np.empty((3, 3)), NO_EQUATIONS)
        np.testing.assert_allclose(found, plain_evidence(ground, h, c), atol=1e-6)
        seen.append(found)
    assert (np.ptp(seen, axis=0) > 5).all(), 'the hypotheses are too much alike'


def test_evidence_adds_up_over_the_points(ground):
    h, c = ground.H[20], ground.model_of[20]

    def part(first, last):
        return np.array(scoring.field_evidence(h, surface_of(ground, c), first, last,
                                               ground.field, np.empty((3, 3)), NO_EQUATIONS))

    np.testing.assert_allclose(part(0, 40) + part(40, 64), part(0, 64))


def test_value_is_mean_evidence_weighed_by_size_minus_the_prior(ground):
    for h, c in zip(ground.H[::4], ground.model_of[::4]):
        agree, violate, shell = plain_evidence(ground, h, c)
        x, y, z = h[7:10]
        area = (x * y + y * z + x * z) / 3
        expected = ((agree - FREE * violate - SHELL * shell) / POINTS * 1.5 * area / (area + 0.5)
                    - PRIOR * (np.log(h[7:10]) ** 2).sum())
        assert value(ground, h, c) == pytest.approx(expected, abs=1e-7)


def test_the_true_pose_scores_above_what_is_clearly_wrong(ground):
    for c in range(3):
        true = ground.H[c]
        best = value(ground, true, c, 512)
        for shift in ([0.03, 0, 0], [0, -0.03, 0], [0, 0, 0.03], [0, 0, -0.03], [0.5, 0, 0]):
            wrong = true.copy()
            wrong[:3] += shift
            assert value(ground, wrong, c, 512) < best
        for factor in (0.6, 1.6):
            wrong = true.copy()
            wrong[7:10] *= factor
            assert value(ground, wrong, c, 512) < best


def test_only_draws_without_hope_are_given_up(ground):
    n, given_up = POINTS, 0
    for h, c in zip(ground.H, ground.model_of):
        whole = value(ground, h, c)

        def tried(least, h=h, c=c):
            return drawing.score_if_hopeful(h, surface_of(ground, c), n, ground.field, WEIGHTS,
                                            np.empty((3, 3)), NO_EQUATIONS, least)

        assert tried(-np.inf) == pytest.approx(whole, abs=1e-9)
        first = value(ground, h, c, int(drawing.FIRST_SHARE * n))
        for least in (0.2, 0.6):
            if first < drawing.HOPEFUL * least:
                assert tried(least) == -np.inf
                given_up += 1
            else:
                assert tried(least) == pytest.approx(whole, abs=1e-9)
    assert 0 < given_up < 2 * len(ground.H)


def test_quick_field_and_its_sum(ground):
    data = ground.field.data
    coarse = scoring.quick_field(data)
    distance, free = data[..., 0] / 255.0, data[..., 1] / 255.0
    expected = np.where(data[..., 0] < 255, 100 * (1 - distance ** 2), -100 * free)
    assert coarse.dtype == np.int8
    assert np.abs(coarse - expected).max() < 1
    for h, c in zip(ground.H, ground.model_of):
        at = [voxel_of(ground, p) for p in posed(ground, h, c, 16)[0]]
        outside = [v for v in at if v is None]
        total = sum(float(coarse[v]) for v in at if v is not None)
        found = scoring.quick_score(h, ground.t.points[c], 16, coarse, ground.field,
                                    np.empty((3, 3)))
        assert found <= total
        assert bool(outside) == (found < total)


def climbed(ground, H, seeds, steps):
    """Return hypotheses (m, 11) after `refine_all`."""
    rows = np.column_stack([H, np.zeros(len(H))])
    refinement.refine_all(seeds, rows, ground.model_of, ground.t, ground.field, WEIGHTS,
                          FieldRefineSettings(POINTS, steps, 0.01, 0.12, 0.08))
    return rows


def test_refinement_never_lowers_a_score_and_reports_it_rightly(ground):
    before = np.array([value(ground, h, c) for h, c in zip(ground.H, ground.model_of)])
    after = climbed(ground, ground.H, np.arange(len(ground.H)), 60)
    again = [value(ground, h, c) for h, c in zip(after, ground.model_of)]
    np.testing.assert_allclose(after[:, 10], again, atol=1e-12)
    assert (after[:, 10] >= before - 1e-12).all()
    assert np.median(after[:, 10] - before) > 0.02
    np.testing.assert_allclose(np.linalg.norm(after[:, 3:7], axis=1), 1, atol=1e-9)
    assert after[:, 7:10].min() >= 0.45
    assert after[:, 7:10].max() <= 2.0


def test_no_steps_change_nothing(ground):
    after = climbed(ground, ground.H, np.arange(len(ground.H)), 0)
    np.testing.assert_array_equal(after[:, :10], ground.H)
    assert after[7, 10] == value(ground, ground.H[7], ground.model_of[7])


def test_one_seed_one_result_whatever_the_threads(ground):
    seeds, known = np.arange(len(ground.H)) + 100, numba.get_num_threads()
    results = []
    try:
        for threads in (1, min(2, numba.config.NUMBA_NUM_THREADS)):
            numba.set_num_threads(threads)
            results.append(climbed(ground, ground.H, seeds, 15))
    finally:
        numba.set_num_threads(known)
    np.testing.assert_array_equal(*results)
    assert (climbed(ground, ground.H, seeds + 1, 15) != results[0]).any()


def drawn_with(size_sigma, tilted):
    """Return DrawSettings of one draw."""
    return DrawSettings(1, 1, size_sigma, tilted, 1, 1)


AXES = {name: np.array(v, float) for name, v in (
    ('x', [1, 0, 0]), ('y', [0, 1, 0]), ('z', [0, 0, 1]), ('-x', [-1, 0, 0]), ('-z', [0, 0, -1]),
    ('slanted', [0.6, 0, 0.8]))}


@pytest.mark.parametrize('model, scene', [
    ('x', 'y'), ('x', 'x'), ('z', '-z'), ('slanted', 'x'), ('y', 'slanted'), ('x', '-x')])
def test_a_drawn_pose_puts_the_point_on_the_scene_with_the_same_facing(model, scene):
    point, at = np.array([[0.03, -0.02, 0.05]]), np.array([[0.2, 0.1, 0.04]])
    normal, scene_normal = AXES[model][None], AXES[scene][None]
    h, q, R = np.empty(10), np.empty(4), np.empty((3, 3))
    spins = set()
    seed_kernels(0)
    for _ in range(10):
        drawing.draw_pose(
            h, drawing.Model(point, normal, np.array([[0, 0, 0, 1.0]]), np.ones(1)),
            Surface(at, scene_normal), 0, drawn_with(size_sigma=0.0, tilted=1.0), q,
            np.empty((3, 3)))
        rotation_of(h, R)
        np.testing.assert_allclose(R @ (point[0] * h[7:10]) + h[:3], at[0], atol=1e-9)
        np.testing.assert_allclose(R @ normal[0], scene_normal[0], atol=1e-9)
        spins.add(tuple(h[3:7].round(6)))
    assert len(spins) == 10


def test_resting_draws_stay_near_their_resting_pose():
    rest = np.array([Rotation.from_euler('x', a).as_quat() for a in (0, np.pi / 2)])
    point, up = np.array([[0.0, 0, 0.05]]), np.array([[0, 0, 1.0]])
    h, q, lean = np.empty(10), np.empty(4), []
    seed_kernels(1)
    for _ in range(200):
        drawing.draw_pose(h, drawing.Model(point, up, rest, np.array([0.5, 1.0])),
                          Surface(np.zeros((1, 3)), up), 0,
                          drawn_with(size_sigma=0.2, tilted=0.0), q,
                          np.empty((3, 3)))
        lean.append(np.arccos(Rotation.from_quat(h[3:7]).as_matrix()[2, 2]))
        assert 0.5 <= h[7:10].min() <= h[7:10].max() <= 1.8
    # About half stand, about half lie.
    lean = np.array(lean)
    assert 0.3 < (lean < 0.8).mean() < 0.7
    assert np.minimum(lean, np.abs(lean - np.pi / 2)).max() < 0.8

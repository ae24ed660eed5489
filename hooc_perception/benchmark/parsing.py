# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Contests of joint parsing: the energy, its search, the overlap of volumes."""

from collections.abc import Sequence
from typing import Any

from hooc_perception.benchmark.measure import Contest, Contestant
from hooc_perception.benchmark.scene import BenchScene, candidate_meshes
from hooc_perception.core.arrays import BoolArray, Float64Array
from hooc_perception.core.energy.eq1 import D_MAX_M, Eq1
from hooc_perception.core.energy.local_search import local_search
from hooc_perception.core.energy.overlap import pairwise, union_shares
from hooc_perception.core.geometry import matrix_from_pose, stage_rng
from hooc_perception.core.methods.genetic import genetic_search, GeneticConfig
from hooc_perception.core.render import render_depth
from hooc_perception.core.types import Candidates, GenericModel
from hooc_perception.objects.repair import closed
import manifold3d
import numpy as np
import trimesh

SUBSETS = 40
EXACT_PAIRS = 60
GENERATIONS = 60


def random_subsets(n: int, count: int, seed: int = 0) -> BoolArray:
    """Return (count, n) bool subsets of about 20 members."""
    return stage_rng(seed, 'bench/subsets').random((count, n)) < 20 / n


def energy_contest(scene: BenchScene) -> Contest:
    """Return the Contest of evaluating Eq. 1 for unrelated subsets."""
    energy = Eq1(scene.observation, scene.probabilities, scene.pool, scene.models)
    masks = random_subsets(len(scene.pool), SUBSETS)
    few = masks[:4]

    def disagreement(a: Float64Array, b: Float64Array) -> np.floating[Any]:
        return np.abs(a[:len(b)] - b).max()

    ours = Contestant('pixel lists in numba (ours)',
                      lambda: np.array([energy.evaluate(mask) for mask in masks]))
    dense = Contestant('render and compare, numba and numpy',
                       lambda: np.array([dense_energy(scene, mask) for mask in few]),
                       len(few) / SUBSETS)
    return Contest('energy of a subset', f'{SUBSETS} subsets of about 20 of {len(scene.pool)}',
                   (ours, dense), disagreement, 1e-3)


def neighbours_contest(scene: BenchScene) -> Contest:
    """Return the Contest of evaluating all subsets that differ by one candidate."""
    energy = Eq1(scene.observation, scene.probabilities, scene.pool, scene.models)
    mask = random_subsets(len(scene.pool), 1)[0]

    def incremental() -> Float64Array:
        energy.reset(mask)
        return energy.value + energy.deltas()

    def afresh() -> Float64Array:
        flips = np.eye(len(mask), dtype=bool)
        return np.array([energy.evaluate(mask ^ flip) for flip in flips])

    return Contest('energies after each flip', f'{len(mask)} neighbours of one subset', (
        Contestant('incremental (ours)', incremental),
        Contestant('each from scratch, in numba', afresh)),
        lambda a, b: np.abs(a - b).max(), 1e-6)


def search_contest(scene: BenchScene, seed: int = 0) -> Contest:
    """Return the Contest of searching the best subset; `search_quality` says how well."""
    energy = Eq1(scene.observation, scene.probabilities, scene.pool, scene.models, 1)
    return Contest('search a subset', f'{len(scene.pool)} candidates, Eq. 1', (
        Contestant('greedy and local search (ours)', lambda: local(energy, seed)),
        Contestant(f"the paper's genetic algorithm, {GENERATIONS} iterations",
                   lambda: genetic(energy, scene.pool, seed))))


def local(energy: Eq1, seed: int) -> BoolArray:
    """Return the mask found by greedy and iterated local search."""
    energy.reset(np.zeros(energy.n, bool))
    return local_search(energy, stage_rng(seed, 'bench/local')).mask


def genetic(energy: Eq1, pool: Candidates, seed: int) -> BoolArray:
    """Return the mask found by the genetic algorithm."""
    return genetic_search(energy.n, energy.evaluate, stage_rng(seed, 'bench/genetic'),
                          GeneticConfig(iterations=GENERATIONS), pool.category, 1)[0]


def search_quality(scene: BenchScene, seed: int = 0) -> dict[str, float]:
    """Return {search: energy that it reaches}, and the energy of the truth."""
    energy = Eq1(scene.observation, scene.probabilities, scene.pool, scene.models, 1)
    return {'greedy and local search': float(energy.evaluate(local(energy, seed))),
            'genetic algorithm': float(energy.evaluate(genetic(energy, scene.pool, seed))),
            'truth': float(energy.evaluate(scene.truth))}


def dense_energy(scene: BenchScene, mask: BoolArray) -> float:
    """Return Eq. 1 of a subset by rendering it and comparing whole images."""
    pool, models, probabilities = scene.pool, scene.models, scene.probabilities
    members = np.flatnonzero(mask)
    meshes = candidate_meshes(scene)
    depth_cost = miss_cost = pixels = 0.0
    for i, view in enumerate(scene.observation.views):
        drawn, ids = render_depth([meshes[k] for k in members], view.camera)
        read = np.isfinite(view.depth)
        background = np.where(np.isfinite(view.background), view.background, np.inf)
        shown = (ids >= 0) & (drawn <= background)
        explained = np.where(shown, drawn, view.background)
        residual = np.minimum(np.abs(explained - view.depth), D_MAX_M) / D_MAX_M
        residual[~np.isfinite(explained)] = 0
        p = np.zeros((*read.shape, len(models) + 1))
        p[..., 0] = 1
        mine = probabilities.camera == i
        u, v = probabilities.uv[mine].T
        p[v, u] = probabilities.p[mine] / 255
        classes = np.where(shown, pool.category[members][ids] if len(members) else 0, 0)
        miss = 1 - np.take_along_axis(p, classes[..., None].astype(int), axis=2)[..., 0]
        depth_cost += residual[read].sum()
        miss_cost += miss[read].sum()
        pixels += read.sum()
    overlap = union_shares(pool.take(members), models).mean() if len(members) else 0.0
    return (depth_cost + miss_cost) / pixels + overlap


def overlap_contest(scene: BenchScene) -> Contest:
    """Return the Contest of the volumes that pairs of candidates share."""
    pool, models = scene.pool, scene.models
    shares = pairwise(pool, models)
    i, j = np.nonzero(np.triu(shares, 1) > 0.02)
    chosen = stage_rng(0, 'bench/pairs').permutation(len(i))[:EXACT_PAIRS]
    i, j = i[chosen], j[chosen]
    solids = {k: _solid(pool, models, k) for k in np.union1d(i, j)}

    def exact() -> Float64Array:
        return np.array([(solids[a] ^ solids[b]).volume() / solids[a].volume()
                         for a, b in zip(i, j)])

    n = len(pool) * (len(pool) - 1) // 2
    ours = Contestant('interior samples in numba (ours)', lambda: pairwise(pool, models)[i, j])
    manifold = Contestant('manifold3d, exact (only pairs that overlap)', exact,
                          len(i) / max(int((np.triu(shares, 1) > 0.02).sum()), 1))
    return Contest('overlap of volumes', f'{n} pairs of candidates', (ours, manifold),
                   lambda a, b: np.abs(a - b).mean(), 0.05)


def _solid(pool: Candidates, models: Sequence[GenericModel], k: int) -> manifold3d.Manifold:
    """Return the manifold3d solid of a candidate."""
    model = pool.take([k]).shapes(models)[0]
    mesh = closed(trimesh.Trimesh(model.vertices, model.faces, process=False))
    vertices = np.asarray(mesh.vertices) * (pool.size[k] / model.extents)
    T_world_model = matrix_from_pose(pool.translation[k], pool.rotation_xyzw[k])
    world = trimesh.transform_points(vertices, T_world_model)
    return manifold3d.Manifold(manifold3d.Mesh(world.astype(np.float32),
                                               np.asarray(mesh.faces, np.uint32)))

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The worst-localized scenes and why their objects were missed."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

from hooc_perception.core.arrays import Float64Array, Int64Array
from hooc_perception.core.render import render_depth, render_patch
from hooc_perception.core.segment.rectify import rectify
from hooc_perception.core.types import GenericModel, RectifiedView
from hooc_perception.errors import HoocError
from hooc_perception.evaluation.as_json import plain
from hooc_perception.evaluation.errors import world_mesh
from hooc_perception.evaluation.evaluate import Evaluation, RECTIFY
from hooc_perception.evaluation.matching import posed, PosedObject, shape_of
from hooc_perception.evaluation.scores import ObjectScore, SceneScore
from hooc_perception.evaluation.tables import Cell, Table
from hooc_perception.io.scenes.files import read_json
from hooc_perception.io.scenes.scene_set import RecordedScene, SceneSet
import numpy as np

# An estimate that covers this share of an object's pixels was taken for it.
IN_PLACE = 0.3
FEW_PIXELS = 200
HIDDEN = 0.5
# {scene: {category: [whether the pool held a candidate near]}}, in the order of the truth.
Pools: TypeAlias = Mapping[str, Mapping[str, list[bool]]]


@dataclass(frozen=True)
class Missed:
    """
    A true object that was not localized.

    :ivar truth: index among the true objects of its scene.
    :ivar why: texts: what happened, then what made it hard.
    :ivar pixels: number of pixels that show it, over all views.
    :ivar visible: their share of the pixels that it would cover alone; None where there are none.
    """

    category: str
    truth: int
    why: tuple[str, ...]
    pixels: int
    visible: float | None


@dataclass(frozen=True)
class WorstScene:
    """
    A scene with its missed objects.

    :ivar localized: share of its true objects.
    :ivar wrong: indices of the estimates that are matched to no localized object.
    :ivar view: the one that shows most of the missed objects.
    """

    name: str
    localized: float
    missed: tuple[Missed, ...]
    wrong: tuple[int, ...]
    truths: tuple[PosedObject, ...] = field(repr=False)
    estimates: tuple[PosedObject, ...] = field(repr=False)
    view: RectifiedView = field(repr=False)


def read_pools(path: str | Path) -> Pools:
    """
    Return `pools_of` a stages file.

    :raises HoocError: where the file is something else.
    """
    stages = read_json(path).get('stages')
    if not stages:
        raise HoocError(f'{path} does not say what the stages lose; write it with hooc stages '
                        '--model MODEL --json')
    return pools_of(stages)


def pools_of(stages: Mapping[str, Any]) -> Pools:
    """
    Return whether the pools held a candidate near each true object.

    :param stages: the losses that `rerun` returns, or the same read from a stages file.
    """
    out: dict[str, dict[str, list[bool]]] = {}
    for scene, loss in plain(stages).items():
        out[scene] = {}
        for thing in loss['pool']['objects']:
            out[scene].setdefault(thing['category'], []).append(thing['near'])
    return out


def worst_scenes(scene_set: SceneSet, evaluation: Evaluation, models: Mapping[str, GenericModel],
                 n: int, pools: Pools | None = None) -> list[WorstScene]:
    """
    Return the n scenes with the smallest localized shares, the worst first.

    Ties are broken by fewer objects within 2 cm, then by more false categories.

    :param models: {category: GenericModel}, see `scoring_models`.
    :param pools: from `pools_of`; None = the candidates are not known.
    """
    scenes = {scene.name: scene for scene in scene_set.scenes}
    order = sorted((s for s in evaluation.scores if s.objects),
                   key=lambda s: (s.localized, s.tight, -s.false_categories))
    return [_looked_at(scenes[s.name], s, tuple(evaluation.estimates[s.name]), models,
                       (pools or {}).get(s.name, {})) for s in order[:n]]


def _looked_at(scene: RecordedScene, score: SceneScore, estimates: tuple[PosedObject, ...],
               models: Mapping[str, GenericModel],
               pool: Mapping[str, list[bool]]) -> WorstScene:
    """Return the WorstScene of a RecordedScene and its SceneScore."""
    truths = tuple(posed(t) for t in scene.truth or ())
    views = [rectify(view, RECTIFY) for view in scene.depth()]
    shown, alone, taken = _pixels(truths, estimates, models, views)
    placed = {o.estimate for o in score.objects if o.localized}
    wrong = tuple(i for i in range(len(estimates)) if i not in placed)
    # The pools count the objects of a category in the order of the truth.
    near_of = {category: iter(near) for category, near in pool.items()}
    missed = []
    for thing in sorted(score.objects, key=lambda o: o.truth):
        near = next(near_of.get(thing.category, iter(())), None)
        if not thing.localized:
            n, most = int(shown[thing.truth].sum()), int(alone[thing.truth].sum())
            visible = n / most if most else None
            why = (*_what_happened(thing, taken[thing.truth] / max(n, 1), estimates, wrong, near),
                   *_what_is_hard(n, visible))
            missed.append(Missed(thing.category, thing.truth, why, n, visible))
    rows = [m.truth for m in missed] or slice(None)
    # The root, so that many objects that are visible a little outweigh one that is visible a lot.
    view = views[int(np.sqrt(shown[rows]).sum(0).argmax())]
    return WorstScene(scene.name, score.localized, tuple(missed), wrong, truths, estimates, view)


def _pixels(truths: Sequence[PosedObject], estimates: Sequence[PosedObject],
            models: Mapping[str, GenericModel], views: Sequence[RectifiedView],
            ) -> tuple[Int64Array, Int64Array, Int64Array]:
    """
    Return (shown (n, V), alone (n, V), taken (n, m)), int arrays.

    Numbers of pixels that show each of n true objects in each view, that would show it if it
    stood alone, and, over all views, of those of the first at which each of m estimates shows.
    """
    true, answer = ([world_mesh(o, shape_of(o, models)) for o in objects]
                    for objects in (truths, estimates))
    shown, alone = (np.zeros((len(true), len(views)), int) for _ in range(2))
    taken = np.zeros((len(true), len(answer)), int)
    for j, view in enumerate(views):
        ids, theirs = (render_depth(meshes, view.camera)[1] for meshes in (true, answer))
        shown[:, j] = np.bincount(ids[ids >= 0], minlength=len(true))
        alone[:, j] = [len(render_patch(*mesh, view.camera)[0]) for mesh in true]
        both = (ids >= 0) & (theirs >= 0)
        np.add.at(taken, (ids[both], theirs[both]), 1)
    return shown, alone, taken


def _what_happened(thing: ObjectScore, shares: Float64Array, estimates: Sequence[PosedObject],
                   wrong: Sequence[int], near: bool | None) -> Iterator[str]:
    """
    Yield what happened to a missed object.

    :param shares: (m,) shares of its pixels at which each estimate shows.
    :param near: whether the pool held a candidate near, None where that is not known.
    """
    if len(shares) and shares.max() >= IN_PLACE:
        most = int(shares.argmax())
        other = estimates[most].category
        if other != thing.category:
            yield f'{"taken for" if most in wrong else "covered by"} {_words(other)}'
    if thing.estimate is not None:
        yield f'found {100 * thing.centre_m:.0f} cm away'
    if near is not None:
        yield 'candidate there, not chosen' if near else 'no candidate'


def _what_is_hard(pixels: int, visible: float | None) -> Iterator[str]:
    """Yield what makes an object hard for any method."""
    if pixels < FEW_PIXELS:
        yield f'few pixels ({pixels})'
    if visible is not None and visible < HIDDEN:
        yield f'visible share {visible:.2f}'


def _words(category: str) -> str:
    """Return the name of a category with spaces."""
    return category.replace('_', ' ')


def worst_json(label: str, scenes: Sequence[WorstScene]) -> dict[str, Any]:
    """Return the content of worst.json: missed objects and wrong estimates of every scene."""
    return plain({'format': 'hooc-worst/1', 'label': label, 'scenes': [
        {'scene': s.name, 'localized': s.localized, 'true': len(s.truths),
         'camera': s.view.camera.name, 'missed': [asdict(m) for m in s.missed],
         'wrong': [{'category': s.estimates[i].category, 'score': s.estimates[i].score,
                    'translation': s.estimates[i].translation} for i in s.wrong]}
        for s in scenes]})


def worst_table(content: Mapping[str, Any]) -> Table:
    """Return the Table of what `worst_json` holds: one row per missed object."""
    rows: list[tuple[Cell, ...]] = []
    for scene in content['scenes']:
        wrong = ', '.join(_words(w['category']) for w in scene['wrong']) or None
        for k, m in enumerate(scene['missed'] or [None]):
            head = (scene['scene'], f'{scene["localized"]:.2f}') if k == 0 else ('', '')
            rows.append((*head, *((None,) * 4 if m is None else (
                _words(m['category']), '; '.join(m['why']) or None, m['pixels'], m['visible'])),
                wrong if k == 0 else ''))
    return Table(
        f'The worst scenes of `{content["label"]}`',
        ('scene', 'localized', 'missed', 'why', 'pixels', 'visible', 'wrong'), tuple(rows),
        (f'taken for, covered by: an estimate that shows at {100 * IN_PLACE:.0f} % or more of the '
         "object's pixels and is itself wrong (taken for) or localized (covered by); candidate "
         "there: the pool held one within half the model's size; pixels: number of pixels that "
         f'show the object, over all views (few: below {FEW_PIXELS}); visible: their share of the '
         f'pixels that it would cover alone (listed as a reason below {HIDDEN}); wrong: estimates '
         'that are matched to no localized object.',))

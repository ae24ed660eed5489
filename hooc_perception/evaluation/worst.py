# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The scenes in which most was missed, and why, from what the scores know anyway."""

from dataclasses import asdict, dataclass, field

from hooc_perception.core.render import render_depth, render_patch
from hooc_perception.core.segment.rectify import rectify
from hooc_perception.core.types import RectifiedView
from hooc_perception.errors import HoocError
from hooc_perception.evaluation.as_json import plain
from hooc_perception.evaluation.errors import world_mesh
from hooc_perception.evaluation.evaluate import RECTIFY
from hooc_perception.evaluation.matching import posed
from hooc_perception.evaluation.tables import Table
from hooc_perception.io.scenes.files import read_json
import numpy as np

# What shows at this share of an object's pixels was put in its place.
IN_PLACE = 0.3
FEW_PIXELS = 200
HIDDEN = 0.5


@dataclass(frozen=True)
class Missed:
    """
    A true object that was not localized.

    :ivar truth: index among the true objects of its scene.
    :ivar why: texts, what happened first, then what made it hard.
    :ivar pixels: number of pixels that show it, over all views.
    :ivar visible: that number over those that it would cover alone; None where it would none.
    """

    category: str
    truth: int
    why: tuple
    pixels: int
    visible: float | None


@dataclass(frozen=True)
class WorstScene:
    """
    A scene with what was missed in it.

    :ivar localized: share of its true objects.
    :ivar missed: tuple of Missed.
    :ivar wrong: indices of the estimates that stand for no localized object.
    :ivar truths, estimates: tuples of PosedObject.
    :ivar view: the RectifiedView that shows most of what was missed.
    """

    name: str
    localized: float
    missed: tuple
    wrong: tuple
    truths: tuple = field(repr=False)
    estimates: tuple = field(repr=False)
    view: RectifiedView = field(repr=False)


def read_pools(path):
    """
    Return `pools_of` a scores file.

    :raises HoocError: where it was written without --stages.
    """
    stages = read_json(path).get('stages')
    if not stages:
        raise HoocError(f'{path} does not say what the stages lose; write it with hooc stages '
                        '--model MODEL --json')
    return pools_of(stages)


def pools_of(stages):
    """
    Return {scene: {category: [whether the pool held a candidate near]}} of the true objects.

    :param stages: what `rerun` returns of the stages, or the same out of a scores file.
    """
    out = {}
    for scene, loss in plain(stages).items():
        out[scene] = {}
        for thing in loss['pool']['objects']:
            out[scene].setdefault(thing['category'], []).append(thing['near'])
    return out


def worst_scenes(scene_set, evaluation, models, n, pools=None):
    """
    Return the n WorstScene with the least localized shares, the worst first.

    Among equals first the one with fewer objects within 2 cm, then with more false categories.

    :param evaluation: Evaluation; its scenes without poses are left out.
    :param models: {category: GenericModel}, see `scoring_models`.
    :param pools: from `pools_of`; None = nobody knows what candidates there were.
    """
    scenes = {scene.name: scene for scene in scene_set.scenes}
    order = sorted((s for s in evaluation.scores if s.objects),
                   key=lambda s: (s.localized, s.tight, -s.false_categories))
    return [_looked_at(scenes[s.name], s, tuple(evaluation.estimates[s.name]), models,
                       (pools or {}).get(s.name, {})) for s in order[:n]]


def _looked_at(scene, score, estimates, models, pool):
    """Return the WorstScene of a RecordedScene and its SceneScore."""
    truths = tuple(posed(t) for t in scene.truth)
    views = [rectify(view, RECTIFY) for view in scene.depth()]
    shown, alone, taken = _pixels(truths, estimates, models, views)
    placed = {o.estimate for o in score.objects if o.localized}
    wrong = tuple(i for i in range(len(estimates)) if i not in placed)
    pool = {category: list(near) for category, near in pool.items()}
    missed = []
    for thing in sorted(score.objects, key=lambda o: o.truth):
        # The pools count the objects of a category in the order of the truth.
        near = pool[thing.category].pop(0) if pool.get(thing.category) else None
        if not thing.localized:
            n, most = int(shown[thing.truth].sum()), int(alone[thing.truth].sum())
            visible = n / most if most else None
            why = (*_what_happened(thing, taken[thing.truth] / max(n, 1), estimates, wrong, near),
                   *_what_is_hard(n, visible))
            missed.append(Missed(thing.category, thing.truth, why, n, visible))
    rows = [m.truth for m in missed] or slice(None)
    # The root, so that many objects that show a little count more than one that shows a lot.
    view = views[int(np.sqrt(shown[rows]).sum(0).argmax())]
    return WorstScene(scene.name, score.localized, tuple(missed), wrong, truths, estimates, view)


def _pixels(truths, estimates, models, views):
    """
    Return (shown (n, V), alone (n, V), taken (n, m)), int arrays.

    Pixels that show each of n true objects, that would if it stood alone, and those of the
    first, over all views, at which each of m estimates shows.
    """
    true, answer = ([world_mesh(o, models[o.category]) for o in objects]
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


def _what_happened(thing, shares, estimates, wrong, near):
    """
    Yield what became of a missed object.

    :param shares: (m,) shares of its pixels at which each estimate shows.
    :param near: whether the pool held a candidate near, None where nobody knows.
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


def _what_is_hard(pixels, visible):
    """Yield what would make any method miss it."""
    if pixels < FEW_PIXELS:
        yield f'few pixels ({pixels})'
    if visible is not None and visible < HIDDEN:
        yield f'visible share {visible:.2f}'


def _words(category):
    return category.replace('_', ' ')


def worst_json(label, scenes):
    """Return the content of worst.json: every scene with what was missed and what was wrong."""
    return plain({'format': 'hooc-worst/1', 'label': label, 'scenes': [
        {'scene': s.name, 'localized': s.localized, 'true': len(s.truths),
         'camera': s.view.camera.name, 'missed': [asdict(m) for m in s.missed],
         'wrong': [{'category': s.estimates[i].category, 'score': s.estimates[i].score,
                    'translation': s.estimates[i].translation} for i in s.wrong]}
        for s in scenes]})


def worst_table(content):
    """Return the Table of what `worst_json` holds: a row a missed object."""
    rows = []
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
        (f'taken for, covered by: what the answer shows at {100 * IN_PLACE:.0f} % or more of the '
         "object's pixels, where that is itself wrong, or localized; candidate there: the pool "
         "held one within half the model's size; pixels: that show the object, over all views "
         f'(few: below {FEW_PIXELS}); visible: that number over those it would cover alone (told '
         f'as a reason below {HIDDEN}); wrong: estimates that stand for no localized object.',))

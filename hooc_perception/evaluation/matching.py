# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Which estimate belongs to which true object: one to one within a category."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from hooc_perception.core.arrays import Float64Array
from hooc_perception.core.geometry import inverse, matrix_from_pose, pose_from_matrix
from hooc_perception.core.types import Candidates, GenericModel
from hooc_perception.errors import HoocError
import numpy as np
from scipy.optimize import linear_sum_assignment


@dataclass(frozen=True)
class PosedObject:
    """
    An object of a category at a pose and a size.

    :ivar translation: (3,) centre of the bounding box, world, metres.
    :ivar rotation_xyzw: (4,) unit quaternion, model axes to world.
    :ivar size: (3,) extents along the model axes, metres.
    :ivar score: of an estimate; 1 for a true object.
    :ivar sigma_t, sigma_r: of an estimate, metres and radians; NaN where unknown.
    :ivar member: of an estimate, which mesh of its category's family was found; 0 = the generic
        one.
    :ivar id: of an estimate, what it is called in successive results; None where it has no id.
    """

    category: str
    translation: Float64Array
    rotation_xyzw: Float64Array
    size: Float64Array
    score: float = 1.0
    sigma_t: float = float('nan')
    sigma_r: float = float('nan')
    member: int = 0
    id: int | None = None


def posed(thing: Any) -> PosedObject:
    """Return a PosedObject of a results entry (a mapping) or of a TrueObject."""
    get = thing.get if isinstance(thing, dict) else lambda k: getattr(thing, k, None)
    score, *sigmas = (get(name) for name in ('score', 'sigma_t', 'sigma_r'))
    try:
        rotation = np.asarray(get('rotation_xyzw'), np.float64).reshape(4)
        return PosedObject(str(get('category')),
                           np.asarray(get('translation'), np.float64).reshape(3),
                           rotation / np.linalg.norm(rotation),
                           np.asarray(get('size'), np.float64).reshape(3),
                           1.0 if score is None else float(score),
                           *(float('nan') if sigma is None else float(sigma)
                             for sigma in sigmas), member=int(get('member') or 0),
                           id=get('id'))
    except (TypeError, ValueError) as error:
        raise HoocError(f'object {get("category")!r} has no usable pose: {error}; give '
                        'translation (3), rotation_xyzw (4) and size (3)') from None


def candidate_objects(candidates: Candidates, names: Sequence[str]) -> list[PosedObject]:
    """Return Candidates as PosedObjects; `names` are those of class ids 1..N."""
    return [PosedObject(names[int(c) - 1], candidates.translation[i],
                        candidates.rotation_xyzw[i], candidates.size[i].astype(np.float64),
                        float(candidates.score[i]), member=int(candidates.member[i]))
            for i, c in enumerate(candidates.category)]


def shape_of(thing: PosedObject, models: Mapping[str, GenericModel]) -> GenericModel:
    """
    Return the mesh with which an object was found.

    :param models: mapping category name -> GenericModel. Where they lack the mesh, the generic
        mesh takes its place.
    """
    return models[thing.category].members[member_of(thing, models)]


def member_of(thing: PosedObject, models: Mapping[str, GenericModel]) -> int:
    """Return the place of the mesh of `shape_of` in its family."""
    return thing.member if thing.member < len(models[thing.category].members) else 0


def in_frame_of(scene: Any, entry: dict[str, Any]) -> dict[str, Any]:
    """
    Return a results entry with its objects in the table frame of a RecordedScene or BagScene.

    Where the world is not known to be a table's, the frame is estimated, and the results say
    which one they used; another version may estimate another, so both are compared in the
    source world. Entries of scenes whose table is known come back as they are.
    """
    if scene.table_known or not entry.get('world', {}).get('table_from_source'):
        return entry
    theirs = entry['world']['table_from_source']
    T_ours_theirs = scene.table.T_table_source @ inverse(
        matrix_from_pose(theirs['translation'], theirs['rotation_xyzw']))
    moved = {}
    for kind in ('objects', 'unknown'):
        moved[kind] = []
        for thing in entry.get(kind) or []:
            translation, rotation = pose_from_matrix(
                T_ours_theirs @ matrix_from_pose(thing['translation'], thing['rotation_xyzw']))
            moved[kind].append(thing | {'translation': translation.tolist(),
                                        'rotation_xyzw': rotation.tolist()})
    return entry | moved | scene.world


def match_by_centre(estimates: Sequence[PosedObject],
                    truths: Sequence[PosedObject]) -> list[tuple[int, int, float]]:
    """
    Return [(i_est, i_true, metres)], one to one within each category.

    The Hungarian method on the distance between centres, as many pairs as the category allows;
    the distance does not limit the pairing, so that errors of badly placed objects show.
    """
    pairs = []
    for category in dict.fromkeys(t.category for t in truths):
        i_est = [i for i, e in enumerate(estimates) if e.category == category]
        i_true = [i for i, t in enumerate(truths) if t.category == category]
        if not i_est:
            continue
        distance = np.array([[np.linalg.norm(np.subtract(truths[t].translation,
                                                         estimates[e].translation))
                              for e in i_est] for t in i_true])
        for row, column in zip(*linear_sum_assignment(distance)):
            pairs.append((i_est[column], i_true[row], float(distance[row, column])))
    return pairs

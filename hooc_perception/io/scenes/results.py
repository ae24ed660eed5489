# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Read and write results files, format `hooc-results/1` (docs/scene_sets.md)."""

from collections.abc import Collection, Iterable, Mapping, Sequence
import json
import math
from pathlib import Path
from typing import Any

from hooc_perception.core.types import ParsedScene
from hooc_perception.errors import HoocError
from hooc_perception.io.scenes import fields, files
import numpy as np

FORMAT = 'hooc-results/1'
# Ids are unsigned 32-bit numbers in the nodes.
LAST_ID = 2 ** 32 - 1
LAST_STAMP_NS = 2 ** 63 - 1
_TERMS = ('total', 'depth', 'probability', 'overlap')


def scene_result(name: str, parsed: ParsedScene, category_names: Sequence[str], seconds: float,
                 **extra: Any) -> dict[str, Any]:
    """Return the dict of one scene in a results file, see `scene_entry` and `parsed_entry`."""
    return scene_entry(name, parsed_entry(parsed, category_names), seconds, **extra)


def scene_entry(name: str, entry: Mapping[str, Any], seconds: float, **extra: Any,
                ) -> dict[str, Any]:
    """
    Return the dict of one scene in a results file.

    :param entry: as `parsed_entry` or `Scene.to_dict` return it.
    :param seconds: from the arrival of the last depth image to the result.
    :param extra: more entries of this scene, such as `world` of a RecordedScene or a seed.
    """
    return {'scene': name, 'seconds': float(seconds), **entry, **extra}


def with_ids(entry: dict[str, Any], ids: Iterable[int], unknown_ids: Iterable[int] = (),
             ) -> dict[str, Any]:
    """Return the dict of a scene with the ids of its objects."""
    for key, numbers in (('objects', ids), ('unknown', unknown_ids)):
        for thing, number in zip(entry.get(key, ()), numbers):
            thing['id'] = int(number)
    return entry


def parsed_entry(parsed: ParsedScene, category_names: Sequence[str]) -> dict[str, Any]:
    """
    Return energy and objects of a ParsedScene as plain numbers and lists.

    :param category_names: names of the class ids 1..N.
    """
    terms = parsed.energy
    energy = {'total': _finite(terms.total), 'depth': _finite(terms.depth),
              'probability': _finite(terms.probability), 'overlap': _finite(terms.overlap)}
    found = parsed.objects
    sigmas = {name: sigma for name, sigma in (('sigma_t', parsed.sigma_t),
                                              ('sigma_r', parsed.sigma_r)) if sigma is not None}
    objects = []
    for i in range(len(found)):
        objects.append({
            'category': category_names[int(found.category[i]) - 1],
            'member': int(found.member[i]),
            'score': _finite(found.score[i]),
            'translation': np.asarray(found.translation[i], np.float64).tolist(),
            'rotation_xyzw': np.asarray(found.rotation_xyzw[i], np.float64).tolist(),
            'size': np.asarray(found.size[i], np.float64).tolist(),
            'visible_ratio': _finite(parsed.visible_ratio[i]),
            'residual_m': _finite(parsed.residual_m[i]),
            'energy_delta': _finite(parsed.energy_delta[i]),
            'n_views': int(parsed.n_views[i]),
            **{name: _finite(sigma[i]) for name, sigma in sigmas.items()}})
    rest = parsed.unknown
    unknown = [{'score': _finite(rest.score[i]),
                'translation': rest.translation[i].tolist(),
                'rotation_xyzw': rest.rotation_xyzw[i].tolist(),
                'size': np.asarray(rest.size[i], np.float64).tolist()} for i in range(len(rest))]
    return {'energy': energy, 'objects': objects, 'unknown': unknown,
            'converged': bool(parsed.converged),
            'stage_seconds': {stage: float(s) for stage, s in parsed.seconds.items()}}


def write_results(path: str | Path, dataset: str, scenes: Iterable[dict[str, Any]],
                  **extra: Any) -> None:
    """
    Write a results file atomically.

    :param scenes: dicts from `scene_result`.
    :param extra: more entries at the top, such as profile and seed.
    :raises HoocError: if an entry breaks the format; nothing is written then.
    """
    content = {'format': FORMAT, 'dataset': dataset, **extra, 'scenes': list(scenes)}
    _check(content, str(path))
    files.write_atomically(path, json.dumps(content, indent=1, allow_nan=False) + '\n')


def load_results(path: str | Path) -> dict[str, Any]:
    """
    Return the checked content of a results file; unknown entries are kept.

    :raises HoocError: one sentence that names file, scene and field.
    """
    content = files.read_json(path)
    _check(content, str(path))
    return content


def scenes_in_common(results: dict[str, Any], names: Collection[str], results_path: str | Path,
                     place: str | Path) -> tuple[dict[str, dict[str, Any]], str]:
    """
    Return ({scene: entry} of the scenes that a set holds, the other scenes in words or '').

    :param results: content of a results file; `names`: the set's scenes.
    :param place: names the set in the error.
    :raises HoocError: if there is no scene in common.
    """
    entries = {entry['scene']: entry for entry in results['scenes']}
    common = {name: entry for name, entry in entries.items() if name in names}
    if not common:
        raise HoocError(f'{results_path} and {place} have no scene in common; '
                        'give the set that the results belong to')
    others = [name for name in entries if name not in names]
    if not others:
        return common, ''
    return common, (f'{"scene" if len(others) == 1 else "scenes"} {", ".join(others[:5])}'
                    f'{" and more" if len(others) > 5 else ""} '
                    f'{"is" if len(others) == 1 else "are"}')


def _check(content: dict[str, Any], path: str) -> None:
    """Raise HoocError if a results file breaks the format."""
    if fields.required(content, 'format', f'{path}:') != FORMAT:
        raise HoocError(f'{path}: format is {fields.short_repr(content["format"])}; this version '
                        f'reads {FORMAT!r}, so write the results again')
    fields.text(fields.required(content, 'dataset', f'{path}:'), f'{path}: dataset')
    scenes = fields.sequence(fields.required(content, 'scenes', f'{path}:'), f'{path}: scenes')
    names = []
    for i, scene in enumerate(scenes):
        scene = fields.mapping(scene, f'{path}: scenes[{i}]')
        names.append(fields.text(fields.required(scene, 'scene', f'{path}: scenes[{i}]:'),
                                 f'{path}: scenes[{i}] scene'))
        _check_scene(scene, f'{path}: scene {names[-1]}:')
    fields.unique(names, f'{path}: scenes')


def _check_scene(scene: dict[str, Any], where: str) -> None:
    """Check one scene's entry; `where` names file and scene."""
    if fields.number(fields.required(scene, 'seconds', where), f'{where} seconds') < 0:
        raise HoocError(f'{where} seconds is negative; give the time that the scene took')
    if scene.get('energy') is not None:
        energy = fields.mapping(scene['energy'], f'{where} energy')
        for term in _TERMS:
            value = fields.required(energy, term, f'{where} energy')
            if value is not None:
                fields.number(value, f'{where} energy {term}')
    objects = fields.sequence(fields.required(scene, 'objects', where), f'{where} objects')
    for i, item in enumerate(objects):
        item = fields.mapping(item, f'{where} objects[{i}]')
        fields.text(fields.required(item, 'category', f'{where} objects[{i}]'),
                    f'{where} objects[{i}] category')
        if item.get('member') is not None:
            fields.integer(item['member'], 0, 65535, f'{where} objects[{i}] member')
        _check_box(item, f'{where} objects[{i}]')
    for i, item in enumerate(fields.sequence(scene.get('unknown') or [], f'{where} unknown')):
        _check_box(fields.mapping(item, f'{where} unknown[{i}]'), f'{where} unknown[{i}]')
    if scene.get('stamp_ns') is not None:
        fields.integer(scene['stamp_ns'], 0, LAST_STAMP_NS, f'{where} stamp_ns')
    if scene.get('events') is not None:
        checked_events(scene['events'], where)


def checked_events(value: object, where: str) -> list[dict[str, Any]]:
    """
    Return the events of one result: dicts as in `objects/events`.

    :param where: names the source in the error.
    :raises HoocError: one sentence that names the field.
    """
    events = [fields.mapping(item, f'{where} events[{i}]')
              for i, item in enumerate(fields.sequence(value, f'{where} events'))]
    for i, item in enumerate(events):
        for key in ('event', 'category'):
            fields.text(fields.required(item, key, f'{where} events[{i}]'),
                        f'{where} events[{i}] {key}')
        fields.integer(fields.required(item, 'id', f'{where} events[{i}]'), 0, LAST_ID,
                       f'{where} events[{i}] id')
        for key in ('translation', 'before'):
            if item.get(key) is not None:
                fields.numbers(item[key], 3, f'{where} events[{i}] {key}')
    return events


def _check_box(item: dict[str, Any], where: str) -> None:
    """Check id, score, pose and size of one entry; `where` names file, scene and row."""
    if item.get('id') is not None:
        fields.integer(item['id'], 0, LAST_ID, f'{where} id')
    if item.get('score') is not None:
        fields.number(item['score'], f'{where} score')
    fields.numbers(fields.required(item, 'translation', where), 3, f'{where} translation')
    quaternion = fields.numbers(fields.required(item, 'rotation_xyzw', where), 4,
                                f'{where} rotation_xyzw')
    if abs(np.linalg.norm(quaternion) - 1) > 1e-3:
        raise HoocError(f'{where} rotation_xyzw has length {np.linalg.norm(quaternion):.6g}; '
                        'give a unit quaternion [x, y, z, w]')
    size = fields.numbers(fields.required(item, 'size', where), 3, f'{where} size')
    if size.min() < 0:
        raise HoocError(f'{where} size is {size.tolist()}; give three lengths in metres')


def _finite(value: Any) -> float | None:
    """Return a float, None if it is not finite: JSON has no NaN."""
    value = float(value)
    return value if math.isfinite(value) else None

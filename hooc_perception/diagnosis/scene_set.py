# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Check a scene set or BOP dataset for everything that prevents or degrades its use."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING
import warnings

from hooc_perception.core.segment.config import ObserveConfig
from hooc_perception.core.segment.observe import observe
from hooc_perception.core.segment.rectify import rectify
from hooc_perception.diagnosis.extrinsics import check_pairs
from hooc_perception.diagnosis.finding import ERROR, Finding, OK, WARNING
from hooc_perception.diagnosis.geometry import check_view, rig_finding
from hooc_perception.errors import HoocError, HoocWarning
from hooc_perception.io.scenes.bop import is_bop
from hooc_perception.io.scenes.scene import Category, RecordedScene
from hooc_perception.io.scenes.scene_set import load_scene_set, SceneSet
from hooc_perception.objects.mesh import load_mesh
import numpy as np

if TYPE_CHECKING:
    from hooc_perception.trained.folder import ModelFolder

# So many scenes, evenly spread, are looked into.
MOST_SCENES = 10
# True objects that differ more than this from the generic mesh are not of its unit.
MOST_RATIO = 3.0


def is_set(path: Path) -> bool:
    """Return whether a folder is a scene set or a BOP dataset."""
    return path.is_dir() and ((path / 'dataset.yaml').is_file() or is_bop(path))


def check_set(path: Path, config: ObserveConfig = ObserveConfig()) -> Iterator[Finding]:
    """Yield a Finding for each check of files, meshes, poses, depth and tables of a set."""
    try:
        has_scenes = is_bop(path) or any((path / 'scenes').glob('[!.]*'))
        scene_set = load_scene_set(path, has_scenes)
    except HoocError as error:
        yield Finding(ERROR, 'set', str(error))
        return
    yield Finding(OK, 'set', f'{len(scene_set.categories)} categories, {len(scene_set.cameras)} '
                  f'cameras, {len(scene_set.scenes)} scenes')
    for category in scene_set.categories:
        yield from _check_category(category, scene_set)
    if not has_scenes:
        yield Finding(WARNING, 'scenes', 'there is none, so depth and poses are not checked; the '
                      'set can be trained on but not parsed')
    scenes = scene_set.scenes
    picks = np.unique(np.linspace(0, len(scenes) - 1, min(len(scenes), MOST_SCENES)).round())
    sound = 0
    for index in picks:
        findings = list(_check_scene(scenes[int(index)], config))
        sound += not findings
        yield from findings
    if sound:
        yield Finding(OK, 'scenes', f'{sound} of {len(picks)} scenes that were looked into are as '
                      'they should be')


def check_set_rig(path: Path, model: 'ModelFolder') -> Iterator[Finding]:
    """Yield whether the cameras of a set are those that a model was trained for."""
    try:
        cameras = load_scene_set(path, with_scenes=False).cameras
    except HoocError:
        return      # check_set reports it
    yield rig_finding(cameras, model)


def _check_category(category: Category, scene_set: SceneSet) -> Iterator[Finding]:
    """Yield what is wrong with the meshes of a category; nothing if they are sound."""
    longest = None
    for path in (category.mesh_path, *category.variant_paths):
        try:
            with warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter('always', HoocWarning)
                mesh = load_mesh(path, category.scale, category.up)
        except HoocError as error:
            yield Finding(ERROR, category.name, str(error))
            continue
        for warning in caught:
            yield Finding(WARNING, category.name, str(warning.message))
        longest = longest or float(mesh.extents.max())
    true = [float(t.size.max()) for scene in scene_set.scenes for t in scene.source_truth or ()
            if t.category == category.name]
    if longest and true:
        ratio = float(np.median(true)) / longest
        if not 1 / MOST_RATIO < ratio < MOST_RATIO:
            yield Finding(WARNING, category.name, f'its true objects are {ratio:.3g} times as '
                          f'long as its mesh ({longest:.3g} m); check its scale in dataset.yaml')


def _check_scene(scene: RecordedScene, config: ObserveConfig) -> Iterator[Finding]:
    """Yield what is wrong with the depth and the cameras of a scene; nothing if all is well."""
    try:
        rectified = [rectify(view, config) for view in scene.depth()]
        observation = observe(rectified, config)
    except HoocError as error:
        yield Finding(ERROR, scene.name, str(error))
        return
    blind = len(observation.troubles) == len(rectified)
    for trouble in observation.troubles:
        yield Finding(ERROR if blind else WARNING, scene.name, trouble)
    if observation.troubles:
        return      # what follows would measure surfaces that are not the table
    views = zip(rectified, observation.views)
    yield from _named(scene.name, [check_view(before.camera, after, config)
                                   for before, after in views])
    yield from _named(scene.name, list(check_pairs(observation)))


def _named(scene: str, findings: Sequence[Finding]) -> Iterator[Finding]:
    """Yield findings that are not OK, with the scene as their subject."""
    for finding in findings:
        if finding.level != OK:
            yield Finding(finding.level, scene, f'{finding.subject}: {finding.text}')

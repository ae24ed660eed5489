# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""How time and memory of a scene grow with views, categories, objects, pixels and changes."""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
import ctypes
from dataclasses import dataclass, replace
import gc
from pathlib import Path
import time
from typing import Any, TypeAlias

from hooc_perception.benchmark.live import views_without
from hooc_perception.core.arrays import AnyArray
from hooc_perception.core.classification.forest import Forest
from hooc_perception.core.geometry import stage_rng
from hooc_perception.core.profiles import Profile
from hooc_perception.core.profiles import profile as named_profile
from hooc_perception.core.segment.observe import observe
from hooc_perception.core.types import DepthView, GenericModel
from hooc_perception.errors import HoocError
from hooc_perception.parser import Parser
from hooc_perception.synthesis.rigs import ring
from hooc_perception.synthesis.scatter import ScatterConfig
from hooc_perception.synthesis.training_scenes import (
    training_scene,
    TrainingConfig,
    TrainingScene,
)
from hooc_perception.trained.folder import ModelFolder
import numpy as np

# Everything else stays at BASE while one of them changes; `pixels` is a factor on a Kinect v2's.
BASE: dict[str, float] = {'views': 3, 'categories': 25, 'objects': 20, 'pixels': 1.0}
AXES: dict[str, Sequence[float]] = {
    'views': (1, 2, 3, 4, 5, 6), 'categories': (10, 25, 50, 100), 'objects': (5, 10, 20, 40),
    'pixels': (0.25, 0.5, 1.0, 2.0, 4.0)}
WIDTH, HEIGHT, FOCAL = 512, 424, 366.0
# Of the objects of the common scene, the share that is gone in a frame set that follows it.
CHANGED = 'changed'
SHARES = (0.0, 0.05, 0.1, 0.2, 0.4)
# Frame sets without change before, so that the answer has settled.
STILL = 4
LABELS = {'pixels': 'pixels, times 512 x 424', CHANGED: 'share of the objects taken'}
# Objects come from the first categories only, so that the scene stays when categories are added.
PRESENT = 10
SIZE_SPREAD = 0.15
# {axis: value}, as BASE.
Setting: TypeAlias = dict[str, float]


@dataclass(frozen=True)
class Point:
    """
    One scene, measured once.

    :ivar cpu_s: processor seconds of all threads, after compilation.
    :ivar peak_mb: peak resident memory of the process meanwhile, libraries and model included;
        NaN where the system does not report it.
    :ivar standing, candidates, found: numbers of objects in the scene, candidates and results.
    """

    setting: Setting
    cpu_s: float
    peak_mb: float
    standing: int
    candidates: int
    found: int


def with_categories(models: Sequence[GenericModel], classifier: Mapping[str, AnyArray],
                    count: int, rng: np.random.Generator,
                    ) -> tuple[tuple[GenericModel, ...], dict[str, Any]]:
    """
    Return (models, classifier) with `count` categories: fewer, or resized copies of them.

    Copies share the probability of their original evenly; that of omitted ones goes to the rest.

    :param classifier: the arrays of the fused forest.
    """
    source = np.arange(count) % len(models)
    more = []
    for k, origin in enumerate(source.tolist()):
        model = models[origin]
        more.append(model if k < len(models) else _resized(
            model, f'{model.name}_{k // len(models) + 1}',
            float(np.exp(SIZE_SPREAD * rng.standard_normal()))))
    forest = Forest.from_arrays(classifier, 'forest_')
    p = forest.leaf_p.astype(float)
    p = np.column_stack([p[:, 0], p[:, 1 + source] / np.bincount(source)[source]])
    total = p.sum(axis=1, keepdims=True)
    p = np.where(total > 0, 255 * p / np.maximum(total, 1e-9), 0)
    arrays = {**classifier, 'classes': np.uint8(count),
              'forest_leaf_p': np.round(p).astype(np.uint8)}
    return tuple(more), arrays


def _resized(model: GenericModel, name: str, factor: float) -> GenericModel:
    """Return a GenericModel of another size; resting poses and symmetry stay valid."""
    return replace(model, name=name, vertices=model.vertices * factor,
                   extents=model.extents * factor,
                   surface_points=model.surface_points * np.float32(factor),
                   interior_points=model.interior_points * np.float32(factor),
                   volume=model.volume * factor ** 3,
                   variants=tuple(_resized(v, name, factor) for v in model.variants))


def synthetic_scene(models: Sequence[GenericModel], views: int, objects: int, pixels: float,
                    seed: int) -> TrainingScene:
    """Return a synthetic scene of the first categories."""
    side = float(np.sqrt(pixels))
    cameras = ring(stage_rng(seed, 'growth/rig', views), views, round(WIDTH * side),
                   round(HEIGHT * side), FOCAL * side)
    present = models[:PRESENT]
    config = TrainingConfig(reshape_strength=1.0, scatter=ScatterConfig(
        objects_low=objects, objects_high=objects, pose='resting', crowding=0.6, tries=200,
        repeats=-(-objects // len(present))))
    return training_scene(present, cameras, stage_rng(seed, 'growth/scene'), config)


def grow(folder: ModelFolder, profile: str | None = None, seed: int = 0,
         axes: Mapping[str, Sequence[float]] | None = None, shares: Sequence[float] = SHARES,
         each: Callable[[list[Any]], Iterable[Any]] = iter) -> dict[str, list[Point]]:
    """
    Return {axis: [Point]}; the common point is measured once. CHANGED is another axis.

    :param folder: ModelFolder of a profile with the fused forest.
    :param profile: name of another profile than the folder's own.
    :param axes: {axis: values}, AXES by default.
    :param shares: of the axis CHANGED: a frame set follows the common scene, without this share
        of its objects.
    :param each: wraps the list of settings, for a progress bar.
    :raises HoocError: where the classifier is bound to a rig.
    """
    if 'forest_leaf_p' not in folder.classifier:
        raise HoocError(f'{folder.path} was trained for one rig (profile {folder.profile}); '
                        'hooc bench growth needs a model of the profile best or fast')
    axes = axes or AXES
    chosen = named_profile(profile or folder.profile)
    settings = {axis: [{**BASE, axis: value} for value in values]
                for axis, values in axes.items()}
    distinct = {_key(s): s for rows in settings.values() for s in rows}
    _measure(folder, chosen, {**BASE, 'views': 2, 'objects': 4, 'pixels': 0.25}, seed)
    points = {key: _measure(folder, chosen, distinct[key], seed)
              for key in each(sorted(distinct))}
    grown = {axis: [points[_key(s)] for s in rows] for axis, rows in settings.items()}
    return grown | {CHANGED: _followed(folder, chosen, shares, seed)} if shares else grown


def _key(setting: Setting) -> tuple[tuple[str, float], ...]:
    """Return a hashable, sortable form of a setting."""
    return tuple(sorted(setting.items()))


def _measure(folder: ModelFolder, chosen: Profile, setting: Setting, seed: int) -> Point:
    """Return the Point of a setting."""
    scene = _scene(folder, setting, seed)
    views = [DepthView(v.camera, v.depth) for v in scene.views]
    parser = _parser(folder, chosen, setting, seed)
    return _timed(lambda: parser.parse(views, seed), setting, len(scene.objects))


def _followed(folder: ModelFolder, chosen: Profile, shares: Sequence[float],
              seed: int) -> list[Point]:
    """Return the Points of frame sets that follow the common scene, see `grow`."""
    scene, parser = _scene(folder, BASE, seed), _parser(folder, chosen, BASE, seed)
    meshes = [(o.vertices_world, o.faces) for o in scene.objects]
    observation, rng = observe(scene.views), stage_rng(seed, 'growth/changed')

    def seen(gone: Collection[int]) -> list[DepthView]:
        return views_without(scene.views, observation, meshes, gone, rng)

    last = None
    for _ in range(1 + STILL):
        last = parser.update(seen(()), last, seed)
    # What only changes need is compiled before.
    parser.update(seen((0,)), last, seed)
    points = []
    for share in shares:
        count = round(share * len(meshes))
        # The same objects and more.
        gone = stage_rng(seed, 'growth/gone').permutation(len(meshes))[:count].tolist()
        views = seen(gone)
        points.append(_timed(lambda views=views: parser.update(views, last, seed),
                             {**BASE, CHANGED: share}, len(meshes) - count))
    return points


def _scene(folder: ModelFolder, setting: Setting, seed: int) -> TrainingScene:
    """Return the scene of a setting."""
    return synthetic_scene(folder.models, int(setting['views']), int(setting['objects']),
                           setting['pixels'], seed)


def _parser(folder: ModelFolder, chosen: Profile, setting: Setting, seed: int) -> Parser:
    """Return the Parser of a setting."""
    return Parser(*with_categories(folder.models, folder.classifier, int(setting['categories']),
                                   stage_rng(seed, 'growth/sizes')), chosen)


def _timed(work: Callable[[], Any], setting: Setting, standing: int) -> Point:
    """Return the Point of work that returns a Scene."""
    _reset_peak()
    start = time.process_time()
    parsed = work().parsed
    seconds = time.process_time() - start
    return Point(setting, seconds, _peak_mb(), standing, len(parsed.pool), len(parsed.objects))


def _reset_peak() -> None:
    """Return freed memory to the system and reset its peak counter (Linux)."""
    gc.collect()
    try:
        ctypes.CDLL(None).malloc_trim(0)
        Path('/proc/self/clear_refs').write_text('5')
    except (OSError, AttributeError):
        pass


def _peak_mb() -> float:
    """Return the process's peak resident memory since `_reset_peak`."""
    try:
        for line in Path('/proc/self/status').read_text().splitlines():
            if line.startswith('VmHWM:'):
                return float(line.split()[1]) / 1024
    except OSError:
        pass
    return float('nan')


def exponent(points: Sequence[Point], axis: str, what: str) -> float:
    """Return k of the least-squares fit value ~ n^k, `what` an attribute of Point."""
    n = np.log([p.setting[axis] for p in points])
    return float(np.polyfit(n, np.log([getattr(p, what) for p in points]), 1)[0])


def write_plot(path: str | Path, grown: Mapping[str, Sequence[Point]], title: str) -> None:
    """Draw time and memory over every axis as one PNG."""
    from matplotlib.figure import Figure
    figure = Figure(figsize=(3.0 * len(grown), 5.2), layout='constrained')
    axes = figure.subplots(2, len(grown), squeeze=False, sharey='row')
    for column, (axis, points) in enumerate(grown.items()):
        n = [p.setting[axis] for p in points]
        for row, (what, label, colour) in enumerate((
                ('cpu_s', 'processor seconds', '#3b6fb6'), ('peak_mb', 'peak MB', '#d9822b'))):
            ax = axes[row, column]
            ax.plot(n, [getattr(p, what) for p in points], 'o-', color=colour)
            if axis in BASE:
                ax.axvline(BASE[axis], color='#6b7280', lw=0.8, ls=':')
            ax.grid(alpha=0.3)
            ax.spines[['top', 'right']].set_visible(False)
            if column == 0:
                ax.set_ylabel(label)
        axes[1, column].set_xlabel(LABELS.get(axis, axis))
    for ax in axes[:, 0]:
        # Last, because a limit that is set stays, whatever is drawn later into its row.
        ax.set_ylim(0, None)
    figure.suptitle(title, fontsize=10)
    Path(path).parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110)

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What `hooc report` shows results of: a scene set, bags, or a recording of the nodes."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TYPE_CHECKING

from hooc_perception.errors import HoocError

if TYPE_CHECKING:
    from hooc_perception.core.types import DepthView, GenericModel
    from hooc_perception.io.bags.reader import BagScene
    from hooc_perception.io.scenes.scene import TrueObject
    from hooc_perception.io.scenes.sequences import RecordedSequence
    from hooc_perception.supervisor.recorded import RecordedResults
    from hooc_perception.trained.folder import ModelFolder


@dataclass(frozen=True)
class Source:
    """
    What the results are of: a scene set, or recorded bags.

    :ivar place: names it in warnings.
    :ivar scenes: its scenes; `views` returns the DepthViews of a scene for its results entry.
    :ivar models: {category: GenericModel}.
    :ivar sequences: those whose frame sets are among the scenes.
    """

    name: str
    place: str | Path
    scenes: Sequence[Any]
    models: Mapping[str, 'GenericModel']
    views: Callable[[Any, dict[str, Any]], Sequence['DepthView']]
    sequences: 'Sequence[RecordedSequence]' = ()


def source_of(path: str, set_path: str | None, wanted: Sequence[str] | None,
              results: dict[str, Any], folder: 'ModelFolder | None') -> Source:
    """
    Return the source of a results file.

    That is --set, else the set or the bags that the results name, relative to their own file.

    :param wanted: names of scenes, None = all.
    """
    from hooc_perception.trained.folder import load_model_folder
    base = Path(path).parent
    place = set_path or _named(base, results, 'set')
    if place:
        from hooc_perception.evaluation.evaluate import scoring_models
        from hooc_perception.io.scenes.scene_set import load_scene_set
        whole = load_scene_set(place)
        scene_set = whole.selected(wanted)
        models = ({model.name: model for model in folder.models} if folder
                  else scoring_models(scene_set))
        return Source(scene_set.name, place, scene_set.scenes, models,
                      lambda scene, entry: scene.depth(), whole.sequences)
    from hooc_perception.io.bags.reader import BagScene
    from hooc_perception.io.bags.sequences import frame_sets, recorded_sequence
    wanted = wanted or [entry['scene'] for entry in results['scenes']]
    bags = {entry['scene']: bag for entry in results['scenes']
            if entry['scene'] in wanted and (bag := _named(base, entry, 'bag'))}
    model = _named(base, results, 'model')
    known = folder.models if folder else load_model_folder(model).models if model else None
    if not bags or known is None:
        raise HoocError(f'{path} names neither a scene set nor bags that still exist; '
                        'name the set with --set')
    read = [BagScene(bag) for bag in dict.fromkeys(bags.values())]
    scenes = [scene for bag in read for scene in (bag, *frame_sets(bag)) if scene.name in bags]
    return Source(results['dataset'], 'its bags', scenes, {m.name: m for m in known},
                  _answered_views, [s for bag in read if (s := recorded_sequence(bag))])


def recorded_source(path: Path, set_path: str | None, wanted: Sequence[str] | None,
                    folder: 'ModelFolder | None') -> tuple[dict[str, Any], Source]:
    """
    Return (content of a results file, its source) of a recording of the nodes.

    Its results are one sequence, the frame sets of which have the names and the truth of the
    sequence that was played, if they are those.

    :param wanted: names of frame sets, None = all.
    :raises HoocError: if the recording has no results, or the model is not known.
    """
    from hooc_perception.io.scenes.results import FORMAT
    from hooc_perception.io.scenes.sequences import PERIOD_S, RecordedSequence
    from hooc_perception.supervisor.recorded import recorded_results
    from hooc_perception.trained.folder import load_model_folder
    if set_path:
        raise HoocError('--set is the scene set of a results file; leave it out for a recording')
    recorded = recorded_results(path)
    if folder is None:
        if recorded.model is None:
            raise HoocError(f'{path}: the meshes that objects/labels names are not there; give '
                            'the model folder with --model')
        folder = load_model_folder(recorded.model)
    models = folder.models
    bag, (frame_sets, known) = recorded.bag, _frame_sets(recorded)
    entries = [result.entry(one.name, [m.name for m in models], **bag.world,
                            events=None if recorded.events is None
                            else recorded.events.get(result.stamp_ns, []))
               for result, one in zip(recorded.results, frame_sets)]
    sequence = RecordedSequence(bag.name, PERIOD_S, tuple(one.name for one in frame_sets), known)
    if wanted and bag.name not in wanted:
        entries = [entry for entry in entries if entry['scene'] in wanted]
    if not entries:
        raise HoocError(f'{path}: it has no frame set {", ".join(wanted or ())}; they are '
                        f'{frame_sets[0].name} to {frame_sets[-1].name}')
    return ({'format': FORMAT, 'dataset': bag.info['dataset'], 'scenes': entries},
            Source(bag.info['dataset'], path, frame_sets, {m.name: m for m in models},
                   lambda scene, entry: bag.views(entry['images']), [sequence]))


@dataclass(frozen=True)
class _FrameSet:
    """A recorded frame set; its results are in the frame of its table."""

    name: str
    truth: 'tuple[TrueObject, ...] | None'
    table_known = True


def _frame_sets(recorded: 'RecordedResults') -> tuple[list[_FrameSet], dict[int, str]]:
    """Return (a frame set for each result, {index: what is known to have happened before it})."""
    bag, results = recorded.bag, recorded.results
    told = bag.info['sequence']
    counts = {bag.topics[topic].count for topic in bag.depth_topics.values()}
    numbers = [set(result.images.values()) for result in results]
    # Where images were lost, nobody knows which frame sets are left.
    if told and counts == {len(told['frame_sets'])} and all(len(n) == 1 for n in numbers):
        truths = list(told['frame_sets'].items())
        indices = [n.pop() for n in numbers]
        return ([_FrameSet(*truths[index]) for index in indices],
                {k: told['events'][index] for k, index in enumerate(indices)
                 if index in told['events']})
    names = [bag.name] if len(results) == 1 else [
        f'{bag.name}_{number:04d}' for number in range(1, len(results) + 1)]
    return [_FrameSet(name, bag.truth) for name in names], {}


def _answered_views(bag: 'BagScene', entry: dict[str, Any]) -> 'Sequence[DepthView]':
    """Return the DepthViews of the frame set of the results, the bag's first if unknown."""
    images = entry.get('images')
    known = isinstance(images, dict) and all(
        isinstance(images.get(camera.name), int) for camera in bag.cameras)
    return bag.views(images if known else None)


def _named(base: Path, entry: dict[str, Any], key: str) -> Path | None:
    """Return the path that an entry names relative to `base`, None where it does not exist."""
    path = entry.get(key)
    if not isinstance(path, str) or '\0' in path or not (base / path).exists():
        return None
    return base / path

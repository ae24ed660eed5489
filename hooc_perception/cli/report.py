# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""`hooc report`: results as one self-contained HTML page."""

from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TYPE_CHECKING

from hooc_perception.cli import options
from hooc_perception.errors import HoocError

if TYPE_CHECKING:
    from hooc_perception.core.types import DepthView, GenericModel
    from hooc_perception.io.bags.reader import BagScene
    from hooc_perception.trained.folder import ModelFolder

HELP = ('Write results as one self-contained HTML page: every view with the measured and the '
        'rendered depth, outlines of the objects, residuals, energies, and the ground truth where '
        'it is known.')


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument('results', metavar='RESULTS.json',
                        help='results of hooc parse, hooc run or hooc baseline')
    parser.add_argument('--set', metavar='SET',
                        help='scene set of the results (default: the set or the bags that the '
                        'results name)')
    parser.add_argument('--model', metavar='MODEL',
                        help='model folder that gave the results: adds a picture of the most '
                        'likely class of every pixel, and draws the meshes of its families')
    parser.add_argument('--candidates', action='store_true',
                        help='run the chain of --model again to list the rejected candidates')
    parser.add_argument('--out', metavar='PATH', default='report.html',
                        help='HTML file, or folder for report.html (default: %(default)s)')
    parser.add_argument('--rerun', metavar='FILE.rrd',
                        help='also write the scenes as a recording for the Rerun viewer (needs '
                        'rerun-sdk)')
    options.add_scene(parser)


@dataclass(frozen=True)
class _Source:
    """
    What the results are of: a scene set, or recorded bags.

    :ivar place: names it in warnings.
    :ivar scenes: its scenes; `views` returns the DepthViews of a scene for its results entry.
    :ivar models: {category: GenericModel}.
    """

    name: str
    place: str | Path
    scenes: Sequence[Any]
    models: Mapping[str, 'GenericModel']
    views: Callable[[Any, dict[str, Any]], Sequence['DepthView']]


def run(args: Namespace) -> None:
    """Write the page and, if requested, the recording."""
    from hooc_perception.cli.places import file_place, page_place
    from hooc_perception.cli.scoring import warn_of_others
    from hooc_perception.evaluation.matching import in_frame_of
    from hooc_perception.evaluation.report.page import write_report
    from hooc_perception.evaluation.report.recording import rerun_sdk, write_recording
    from hooc_perception.evaluation.report.scene import report_scene
    from hooc_perception.io.scenes.results import load_results, scenes_in_common
    from hooc_perception.trained.folder import load_model_folder
    from tqdm import tqdm

    if args.candidates and not args.model:
        raise HoocError('--candidates runs the chain again and needs a trained model; '
                        'give its folder with --model')
    page_place(args.out, '--out')
    if file_place(args.rerun, '--rerun'):
        rerun_sdk()
    folder = load_model_folder(args.model) if args.model else None
    results = load_results(args.results)
    source = _source(args, results, folder)
    entries, others = scenes_in_common(results, {s.name for s in source.scenes}, args.results,
                                       source.place)
    warn_of_others(args.results, others if not args.scene else '', source.place)
    shown = [scene for scene in source.scenes if scene.name in entries]
    extras = None
    if folder:
        from hooc_perception.evaluation.rerun import Rerun
        extras = Rerun(folder)
    scenes = []
    for scene in tqdm(shown, desc='pictures', unit='scene', disable=None):
        entry = in_frame_of(scene, entries[scene.name])
        views = source.views(scene, entry)
        more = extras.for_report(views, args.candidates) if extras else {}
        scenes.append(report_scene(entry, views, source.models, scene.truth, **more))
    notes = [f'Set {source.name}' + ''.join(
        f', {key} {results[key]}' for key in ('profile', 'seed', 'setting') if key in results)]
    title = f'Objects on the table: {results["dataset"]}'
    written = [write_report(args.out, scenes, title, notes)]
    if args.rerun:
        written.append(write_recording(args.rerun, scenes, title))
    for path in written:
        print(f'{path}: {len(scenes)} scene{"s" if len(scenes) != 1 else ""}, '
              f'{path.stat().st_size / 1e6:.1f} MB')


def _source(args: Namespace, results: dict[str, Any], folder: 'ModelFolder | None') -> _Source:
    """
    Return the source of the results.

    That is --set, else the set or the bags that the results name, relative to their own file.
    """
    from hooc_perception.trained.folder import load_model_folder
    base = Path(args.results).parent
    place = args.set or _named(base, results, 'set')
    if place:
        from hooc_perception.evaluation.evaluate import scoring_models
        from hooc_perception.io.scenes.scene_set import load_scene_set
        scene_set = load_scene_set(place).selected(args.scene)
        models = ({model.name: model for model in folder.models} if folder
                  else scoring_models(scene_set))
        return _Source(scene_set.name, place, scene_set.scenes, models,
                       lambda scene, entry: scene.depth())
    from hooc_perception.io.bags.reader import BagScene
    from hooc_perception.io.bags.sequences import frame_sets
    wanted = args.scene or [entry['scene'] for entry in results['scenes']]
    bags = {entry['scene']: bag for entry in results['scenes']
            if entry['scene'] in wanted and (bag := _named(base, entry, 'bag'))}
    model = _named(base, results, 'model')
    known = folder.models if folder else load_model_folder(model).models if model else None
    if not bags or known is None:
        raise HoocError(f'{args.results} names neither a scene set nor bags that still exist; '
                        'name the set with --set')
    scenes = [scene for bag in map(BagScene, dict.fromkeys(bags.values()))
              for scene in (bag, *frame_sets(bag)) if scene.name in bags]
    return _Source(results['dataset'], 'its bags', scenes, {m.name: m for m in known},
                   _answered_views)


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

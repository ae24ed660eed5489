# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""`hooc report`: results as one self-contained HTML page."""

from pathlib import Path
import sys
from types import SimpleNamespace

from hooc_perception.errors import HoocError

HELP = ('Write results as one self-contained HTML page: every view with the measured and the '
        'explained depth, outlines of the objects, residuals, energies, and the truth beside it '
        'where it is known.')


def add_arguments(parser):
    """Declare the arguments."""
    parser.add_argument('results', metavar='RESULTS.json',
                        help='results of `hooc parse` or `hooc run`')
    parser.add_argument('--set', metavar='SET',
                        help='the scene set that the results are of (default: the set, or the '
                        'bags, that the results name)')
    parser.add_argument('--model', metavar='MODEL',
                        help='model folder: adds the most likely class of every pixel')
    parser.add_argument('--candidates', action='store_true',
                        help='run the chain of --model again, to list the rejected candidates')
    parser.add_argument('--out', metavar='PATH', default='report.html',
                        help='HTML file, or folder for report.html (default: %(default)s)')
    parser.add_argument('--rerun', metavar='FILE.rrd',
                        help='also write the scenes as a recording for the Rerun viewer (needs '
                        'rerun-sdk)')
    parser.add_argument('--scene', metavar='ID', action='append', default=[],
                        help='show this scene only (repeatable)')


def run(args):
    """Run the command; return the exit code."""
    from hooc_perception.cli.places import file_place, page_place
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
    if others and not args.scene:
        print(f'[WARN] {args.results}: {others} not in {source.place} and left out',
              file=sys.stderr)
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
    title = f'What stands on the table: {results["dataset"]}'
    written = [write_report(args.out, scenes, title, notes)]
    if args.rerun:
        written.append(write_recording(args.rerun, scenes, title))
    for path in written:
        print(f'{path}: {len(scenes)} scene{"s" if len(scenes) != 1 else ""}, '
              f'{path.stat().st_size / 1e6:.1f} MB')
    return 0


def _source(args, results, folder):
    """
    Return what the results are of: name, place, scenes and models {category: GenericModel}.

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
        return SimpleNamespace(name=scene_set.name, place=place, scenes=scene_set.scenes,
                               models=models, views=lambda scene, entry: scene.depth())
    from hooc_perception.io.bags.reader import BagScene
    wanted = args.scene or [entry['scene'] for entry in results['scenes']]
    bags = {entry['scene']: bag for entry in results['scenes']
            if entry['scene'] in wanted and (bag := _named(base, entry, 'bag'))}
    model = _named(base, results, 'model')
    if not bags or not (folder or model):
        raise HoocError(f'{args.results} does not say which set or bags it is of, or they have '
                        'been moved; name the set with --set')
    models = (folder or load_model_folder(model)).models
    return SimpleNamespace(
        name=results['dataset'], place='its bags', models={m.name: m for m in models},
        scenes=[BagScene(bag) for bag in bags.values()], views=_answered_views)


def _answered_views(bag, entry):
    """Return the DepthViews of the frame set that was answered, the bag's first if unknown."""
    images = entry.get('images')
    known = isinstance(images, dict) and all(
        isinstance(images.get(camera.name), int) for camera in bag.cameras)
    return bag.views(images if known else None)


def _named(base, entry, key):
    """Return the path that an entry names relative to `base`, None where nothing is there."""
    path = entry.get(key)
    if not isinstance(path, str) or '\0' in path or not (base / path).exists():
        return None
    return base / path

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""`hooc report`: results as one self-contained HTML page."""

from hooc_perception.errors import HoocError

HELP = ('Write results as one self-contained HTML page: every view with the measured and the '
        'explained depth, outlines of the objects, residuals, energies, and the truth beside it '
        'where it is known.')


def add_arguments(parser):
    """Declare the arguments."""
    parser.add_argument('results', metavar='RESULTS.json',
                        help='results of `hooc parse` or `hooc run`')
    parser.add_argument('--set', metavar='SET', required=True,
                        help='the scene set that the results are of')
    parser.add_argument('--model', metavar='MODEL',
                        help='model folder: adds the most likely class of every pixel')
    parser.add_argument('--candidates', action='store_true',
                        help='run the chain of --model again, to list the rejected candidates')
    parser.add_argument('--out', metavar='PATH', default='report.html',
                        help='HTML file, or folder for report.html (default: %(default)s)')
    parser.add_argument('--scene', metavar='ID', action='append', default=[],
                        help='show this scene only (repeatable)')


def run(args):
    """Run the command; return the exit code."""
    from hooc_perception.evaluation.evaluate import scoring_models
    from hooc_perception.evaluation.matching import in_frame_of
    from hooc_perception.evaluation.report.page import write_report
    from hooc_perception.evaluation.report.scene import report_scene
    from hooc_perception.models.folder import load_model_folder
    from hooc_perception.scenes.results import load_results
    from hooc_perception.scenes.scene_set import load_scene_set
    from tqdm import tqdm

    if args.candidates and not args.model:
        raise HoocError('--candidates runs the chain again and needs a trained model; '
                        'give its folder with --model')
    folder = load_model_folder(args.model) if args.model else None
    results = load_results(args.results)
    scene_set = load_scene_set(args.set).selected(args.scene)
    entries = {entry['scene']: entry for entry in results['scenes']}
    shown = [scene for scene in scene_set.scenes if scene.name in entries]
    if not shown:
        raise HoocError(f'{args.results} and {args.set} have no scene in common'
                        f'{" among " + ", ".join(args.scene) if args.scene else ""}; '
                        'give the set that the results are of')
    models, extras = scoring_models(scene_set), None
    if folder:
        from hooc_perception.evaluation.rerun import Rerun
        extras = Rerun(folder)
        models = {model.name: model for model in extras.models}
    scenes = []
    for scene in tqdm(shown, desc='pictures', unit='scene', disable=None):
        views = scene.depth()
        more = extras.for_report(views, args.candidates) if extras else {}
        entry = in_frame_of(scene, entries[scene.name])
        scenes.append(report_scene(entry, views, models, scene.truth, **more))
    notes = [f'Set {scene_set.name}' + ''.join(
        f', {key} {results[key]}' for key in ('profile', 'seed', 'setting') if key in results)]
    path = write_report(args.out, scenes, f'What stands on the table: {results["dataset"]}',
                        notes)
    print(f'{path}: {len(scenes)} scene{"s" if len(scenes) != 1 else ""}, '
          f'{path.stat().st_size / 1e6:.1f} MB')
    return 0

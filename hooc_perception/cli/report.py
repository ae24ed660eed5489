# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""`hooc report`: results as one self-contained HTML page."""

from argparse import ArgumentParser, Namespace
from pathlib import Path

from hooc_perception.cli import options
from hooc_perception.errors import HoocError

HELP = ('Write results as one self-contained HTML page: every view with the measured and the '
        'rendered depth, outlines of the objects, residuals, energies, and the ground truth where '
        'it is known. Sequences have a slider.')


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument('results', metavar='RESULTS',
                        help='results file of hooc parse, hooc run or hooc baseline, or a bag '
                        'with the topics of the nodes, such as hooc run --record writes')
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


def run(args: Namespace) -> None:
    """Write the page and, if requested, the recording."""
    from hooc_perception.cli.places import file_place, page_place
    from hooc_perception.cli.report_source import recorded_source, source_of
    from hooc_perception.cli.scoring import warn_of_others
    from hooc_perception.evaluation.matching import in_frame_of
    from hooc_perception.evaluation.report.page import write_report
    from hooc_perception.evaluation.report.recording import rerun_sdk, write_recording
    from hooc_perception.evaluation.report.scene import report_scene
    from hooc_perception.evaluation.report.sequence import in_sequences, scenes_of
    from hooc_perception.io.bags.folder import is_bag
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
    if is_bag(Path(args.results)):
        results, source = recorded_source(Path(args.results), args.set, args.scene, folder)
    else:
        results = load_results(args.results)
        source = source_of(args.results, args.set, args.scene, results, folder)
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
    in_order = in_sequences(scenes, source.sequences)
    written = [write_report(args.out, in_order, title, notes)]
    if args.rerun:
        written.append(write_recording(args.rerun, scenes_of(in_order), title))
    for path in written:
        print(f'{path}: {len(scenes)} scene{"s" if len(scenes) != 1 else ""}, '
              f'{path.stat().st_size / 1e6:.1f} MB')

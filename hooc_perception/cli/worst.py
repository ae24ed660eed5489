# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""`hooc worst`: pictures of the worst-localized scenes and why objects were missed."""

from argparse import ArgumentParser, Namespace
from pathlib import Path

from hooc_perception.cli import options
from hooc_perception.errors import HoocError

HELP = ('Plot the worst-localized scenes of a results file and list for every missed object what '
        'happened to it. Writes worst.png, worst.json and worst.md.')


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument('set', metavar='SET', help='scene set or BOP dataset with true poses')
    parser.add_argument('results', metavar='RESULTS.json',
                        help='results of hooc parse, hooc run or hooc baseline')
    parser.add_argument('--out', metavar='DIR', required=True, help='folder to write into')
    parser.add_argument('--count', metavar='N', type=int, default=5,
                        help='number of scenes (default: %(default)s)')
    options.add_scene(parser)
    parser.add_argument('--stages', metavar='STAGES.json',
                        help='figures of hooc stages --json: adds whether a missed object had a '
                        'candidate')


def run(args: Namespace) -> None:
    """Find the worst scenes, print and plot them."""
    from hooc_perception.cli.places import folder_place
    from hooc_perception.cli.scoring import load_matching, print_tables, require_poses
    from hooc_perception.evaluation import worst
    from hooc_perception.evaluation.evaluate import evaluate_results, scoring_models
    from hooc_perception.evaluation.worst_sheet import write_worst
    from hooc_perception.io.scenes.scene_set import load_scene_set

    if args.count < 1:
        raise HoocError(f'--count is {args.count}; give the number of scenes, 1 or more')
    folder_place(args.out, '--out')
    pools = worst.read_pools(args.stages) if args.stages else None
    whole_set = load_scene_set(args.set)
    scene_set = whole_set.selected(args.scene)
    require_poses(scene_set, 'worst')
    models = scoring_models(scene_set)
    evaluation = evaluate_results(scene_set, load_matching(args.results, whole_set), models,
                                  Path(args.results).stem)
    scenes = worst.worst_scenes(scene_set, evaluation, models, args.count, pools)
    print_tables([worst.worst_table(worst.worst_json(evaluation.label, scenes))])
    for path in write_worst(args.out, evaluation.label, scenes, models):
        print(path)

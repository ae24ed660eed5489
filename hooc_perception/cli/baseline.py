# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""`hooc baseline`: results of a standard method, to compare with."""

from argparse import ArgumentParser, Namespace

from hooc_perception.cli import options

HELP = ('Register every generic model to the point cloud of each scene with a standard method '
        'and write a results file, which hooc evaluate scores like any other.')


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument('set', metavar='SET', help='scene set or BOP dataset')
    parser.add_argument('--method', choices=('fpfh', 'ppf'), required=True,
                        help='fpfh = FPFH features, RANSAC and ICP per category (Open3D); '
                        'ppf = point pair features (OpenCV)')
    parser.add_argument('--out', metavar='RESULTS.json', required=True,
                        help='results file to write')
    options.add_scene(parser)
    parser.add_argument('--seed', type=int, default=0, help='default: %(default)s')


def run(args: Namespace) -> None:
    """Run the baseline and say where its results are."""
    from hooc_perception.cli.places import file_place
    from hooc_perception.evaluation.baselines import run_baseline
    from hooc_perception.evaluation.evaluate import scoring_models
    from hooc_perception.io.scenes.scene_set import load_scene_set

    file_place(args.out, '--out')
    scene_set = load_scene_set(args.set).selected(args.scene)
    run_baseline(args.method, scene_set, scoring_models(scene_set, args.seed), args.out, args.seed)
    print(args.out)

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""`hooc export`: results in the CSV format of the BOP challenge."""

from argparse import ArgumentParser, Namespace

from hooc_perception.cli import options

HELP = ("Write results in BOP's CSV format, one row per estimate and view, for bop_toolkit. "
        "Poses map the model file's coordinates into the camera, in millimetres.")


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument('set', metavar='SET', help='scene set or BOP dataset of the results')
    parser.add_argument('results', metavar='RESULTS.json',
                        help='results of hooc parse, hooc run or hooc baseline')
    parser.add_argument('--out', metavar='FILE.csv', required=True, help='file to write')
    options.add_scene(parser)


def run(args: Namespace) -> None:
    """Write the file and say how many rows it has."""
    from hooc_perception.cli.places import file_place
    from hooc_perception.cli.scoring import load_matching
    from hooc_perception.evaluation.bop_csv import write_bop_csv
    from hooc_perception.io.scenes.scene_set import load_scene_set

    file_place(args.out, '--out')
    whole_set = load_scene_set(args.set)
    rows = write_bop_csv(args.out, load_matching(args.results, whole_set),
                         whole_set.selected(args.scene))
    print(f'{args.out}: {rows} rows')

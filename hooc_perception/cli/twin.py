# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""`hooc twin`: write a synthetic benchmark set."""

from argparse import ArgumentParser, Namespace

from hooc_perception.cli import options
from hooc_perception.errors import HoocError

HELP = ('Write a synthetic scene set modelled on HOOC: 25 categories, 5 scenes of 10 and 4 of 20 '
        'objects settled by physics, three Kinect v2. The same seed gives the same set.')


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument('--out', required=True, metavar='SET', help='folder to write')
    parser.add_argument('--seed', type=int, default=0,
                        help='the same seed gives the same set (default: %(default)s)')
    parser.add_argument('--scene', nargs='+', default=[], metavar='ID',
                        help='only these scenes, such as 10_1 20_4; they are those of the full '
                        'set')
    parser.add_argument('--cameras', type=int, default=3, metavar='N',
                        help='cameras around the table, 1 to 8 (default: %(default)s, as in HOOC)')
    parser.add_argument('--repeat', action='store_true',
                        help='allow several objects of one category in a scene')
    parser.add_argument('--strength', type=float, default=1.0, metavar='S',
                        help='how far objects deviate from their generic models, 0 to 2 '
                        '(default: %(default)g)')
    parser.add_argument('--families', action='store_true',
                        help='make the objects from styles of the built-in catalogue that '
                        'training never sees')
    parser.add_argument('--jobs', type=int, default=0, metavar='N',
                        help='parallel workers, 0 = all cores; does not change the set')
    options.add_executor(parser)


def run(args: Namespace) -> None:
    """Write the set."""
    from hooc_perception.cli.places import folder_place
    from hooc_perception.executor import executor
    from hooc_perception.synthesis.twin import TwinOptions, write_twin
    if args.jobs < 0:
        raise HoocError('--jobs must not be negative')
    folder_place(args.out, '--out')
    options = TwinOptions(tuple(args.scene), args.cameras, args.repeat, args.strength,
                          args.families)
    with executor(args.executor):
        print(write_twin(args.out, args.seed, options, progress=True, jobs=args.jobs or -1))

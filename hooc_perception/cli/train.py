# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""`hooc train`: a MODEL folder from a set's generic meshes and cameras."""

from argparse import ArgumentParser, Namespace
from pathlib import Path
import time

from hooc_perception.cli import options

HELP = ('Train a model from the generic meshes and the cameras of a scene set. Its scenes are '
        'never read. Profile paper trains for exactly this rig; best and fast work with any.')


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the arguments of `hooc train`."""
    parser.add_argument('set', type=Path, metavar='SET', help='folder of a scene set')
    parser.add_argument('--out', type=Path, required=True, metavar='MODEL',
                        help='model folder to write; an existing one is replaced')
    options.add_profile(parser, 'best')
    parser.add_argument('--seed', type=int, default=0,
                        help='the same seed gives the same model (default: %(default)s)')
    parser.add_argument('--relatives', action='store_true',
                        help='also train on shapes that only share the name with the meshes: the '
                        'families of the built-in catalogue, reshaped copies elsewhere')
    parser.add_argument('--strangers', action='store_true',
                        help='train among things of no category, so that categories are not '
                        'forced on what the set does not know')
    parser.add_argument('--jobs', type=int, default=0, metavar='N',
                        help='parallel workers, 0 = all cores; does not change the model')
    options.add_executor(parser)


def run(args: Namespace) -> None:
    """Train and print where the model is."""
    from hooc_perception.cli.places import folder_place
    from hooc_perception.errors import HoocError
    from hooc_perception.executor import executor
    from hooc_perception.io.scenes.scene_set import load_scene_set
    from hooc_perception.training.train import configs_of, train
    if args.seed < 0 or args.jobs < 0:
        raise HoocError('--seed and --jobs must not be negative')
    folder_place(args.out, '--out')
    start = time.monotonic()
    scene_set = load_scene_set(args.set, with_scenes=False)
    with executor(args.executor):
        folder = train(scene_set, args.out, args.profile, args.seed, jobs=args.jobs,
                       configs=configs_of(args.profile, args.relatives, args.strangers))
    print(f'{folder.path}: {len(folder.models)} categories, profile {folder.profile}, '
          f'{time.monotonic() - start:.0f} s')

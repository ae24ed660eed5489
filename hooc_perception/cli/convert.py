# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The command `hooc convert`: scene sets and BOP datasets become bags."""

from pathlib import Path

HELP = 'write a scene set or BOP dataset as rosbag2 bags, one a scene'


def add_arguments(parser):
    """Declare the command's arguments."""
    parser.add_argument('set', type=Path, metavar='SET', help='scene set or BOP dataset')
    parser.add_argument('--out', type=Path, required=True, metavar='DIR',
                        help='folder of the bags')
    parser.add_argument('--scene', action='append', default=[], metavar='ID', nargs='+',
                        help='only these scenes')
    parser.add_argument('--storage', choices=('mcap', 'sqlite3'), default='mcap',
                        help='storage of the bags (default: mcap)')
    parser.add_argument('--repeat', type=int, default=1, metavar='N',
                        help='frame sets in a bag: the same images with new stamps (default: 1)')
    parser.add_argument('--rate', type=float, default=10.0, metavar='HZ',
                        help='frame sets a second (default: 10)')


def run(args):
    """Write the bags; print where they are."""
    from hooc_perception.replay.bag_writer import write_bag
    from hooc_perception.scenes.scene_set import load_scene_set
    from tqdm import tqdm

    chosen = [name for names in args.scene for name in names]
    scene_set = load_scene_set(args.set).selected(chosen)
    for scene in tqdm(scene_set.scenes, desc='bags', unit='scene'):
        write_bag(scene, scene_set, args.out, args.storage, args.repeat, args.rate)
    print(f'{len(scene_set.scenes)} bags in {args.out}')

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The command `hooc convert`: scene sets and BOP datasets to bags, calibrations to YAML."""

from argparse import ArgumentParser, Namespace
from collections.abc import Iterable
from pathlib import Path

from hooc_perception.errors import HoocError

HELP = ('Write a scene set or BOP dataset as rosbag2 bags, one per sequence and one per other '
        "scene; or calibrations of Bouguet's toolbox as a cameras.yaml.")


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument('set', type=Path, metavar='SET', nargs='?',
                        help='scene set (docs/scene_sets.md) or BOP dataset')
    parser.add_argument('--out', type=Path, required=True, metavar='DIR',
                        help='folder for the bags; with --calibration, the cameras.yaml to write')
    parser.add_argument('--scene', action='extend', default=[], metavar='ID', nargs='+',
                        help='only these scenes, or all of these sequences')
    parser.add_argument('--storage', choices=('mcap', 'sqlite3'), default='mcap',
                        help='storage format of the bags (default: %(default)s)')
    parser.add_argument('--repeat', type=int, default=1, metavar='N',
                        help='frame sets per bag of a single scene: the same images with new '
                        'stamps (default: %(default)s)')
    parser.add_argument('--rate', type=float, default=10.0, metavar='HZ',
                        help='frame sets per second of such a bag (default: %(default)g); '
                        'sequences keep their own period')
    parser.add_argument('--calibration', action='extend', default=[], metavar='NAME=FILE[#VIEW]',
                        nargs='+', help="instead of SET: Calib_Results.mat or .m of Bouguet's "
                        'toolbox, one per camera; VIEW is the calibration image in which the '
                        'board lay on the table, or left or right of a stereo pair')
    parser.add_argument('--unit', type=float, default=0.001, metavar='METRES',
                        help='unit in which the calibration board was measured, in metres '
                        '(default: %(default)g)')


def run(args: Namespace) -> None:
    """Write the bags, or the cameras.yaml of calibrations; print where they are."""
    if bool(args.calibration) == bool(args.set):
        raise HoocError('give either SET or --calibration, see hooc convert --help')
    if args.calibration:
        write_calibrations(args.calibration, args.unit, args.out)
    else:
        write_bags(args)


def write_bags(args: Namespace) -> None:
    """Write one bag per sequence, and one per scene that is in none."""
    from hooc_perception.cli.places import folder_place
    from hooc_perception.io.bags.writer import write_bag, write_sequence
    from hooc_perception.io.scenes.scene_set import load_scene_set
    from tqdm import tqdm

    folder_place(args.out, '--out')
    scene_set = load_scene_set(args.set).selected(args.scene)
    inside = {name for sequence in scene_set.sequences for name in sequence.scenes}
    single = [scene for scene in scene_set.scenes if scene.name not in inside]
    count = len(single) + len(scene_set.sequences)
    with tqdm(total=count, desc='bags', unit='bag') as progress:
        for sequence in scene_set.sequences:
            write_sequence(sequence, scene_set, args.out, args.storage)
            progress.update()
        for scene in single:
            write_bag(scene, scene_set, args.out, args.storage, args.repeat, args.rate)
            progress.update()
    print(f'{count} bag{"s" * (count != 1)} in {args.out}')


def write_calibrations(entries: Iterable[str], unit: float, out: Path) -> None:
    """Write a cameras.yaml from entries NAME=FILE[#VIEW]."""
    from hooc_perception.io.scenes.bouguet import load_bouguet, upright
    from hooc_perception.io.scenes.camera_files import write_cameras
    from hooc_perception.io.scenes.fields import unique

    if not 1e-6 <= unit <= 1:
        raise HoocError(f'--unit is {unit:g}; give metres, 0.001 for a board in millimetres')
    cameras = []
    for entry in entries:
        name, _, file = entry.partition('=')
        file, _, view = file.partition('#')
        if not file:
            raise HoocError(f'--calibration {entry}: the file is missing; write NAME=FILE, such '
                            'as kinect1=left/Calib_Results.mat')
        cameras.append(load_bouguet(file, name, view or None, unit))
    unique([camera.name for camera in cameras], '--calibration')
    if out.exists():
        raise HoocError(f'{out} exists already; remove it or choose another file')
    write_cameras(out, upright(cameras))
    print(f'{len(cameras)} cameras in {out}')

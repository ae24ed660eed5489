# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""`hooc calibrate`: refines the poses of fixed cameras against each other and the table."""

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from hooc_perception.cli import options
from hooc_perception.errors import HoocError

if TYPE_CHECKING:
    from hooc_perception.calibration.recordings import Recording

HELP = ('Refine the poses of fixed cameras against each other and the table that they see, from '
        'poses that are right to 5 degrees and 5 cm. Write cameras.yaml and print figures before '
        'and after. Nothing is written where the scenes do not determine the poses.')


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument('sources', metavar='BAG|SET', nargs='+', type=Path,
                        help='a scene set, or one or more bags of the same rig')
    parser.add_argument('--out', required=True, metavar='cameras.yaml',
                        help='file to write, for --cameras of hooc up and for scene sets')
    options.add_scene(parser)
    parser.add_argument('--frames', type=int, default=8, metavar='N',
                        help='frame sets to take from each bag (default: %(default)s)')
    parser.add_argument('--picture', metavar='FILE.png',
                        help='also draw the points of one frame set before and after')
    parser.add_argument('--ros', action='store_true',
                        help='also print static_transform_publisher commands and the parameters '
                        'of the ingestion node')


def run(args: Namespace) -> None:
    """Run the command."""
    from hooc_perception.calibration.calibrate import calibrate
    from hooc_perception.calibration.figures import as_ros, as_text, write_picture
    from hooc_perception.cli.places import file_place
    from hooc_perception.io.scenes.camera_files import write_cameras
    from tqdm import tqdm
    out, picture = file_place(args.out, '--out'), file_place(args.picture, '--picture')
    if args.frames < 1:
        raise HoocError(f'--frames is {args.frames}; give 1 or more')
    recording = _recording(args)
    if recording.left_out:
        print(recording.left_out)
    result = calibrate(tqdm(recording.read(), 'reading', len(recording.frames), unit='scene',
                            disable=None), recording.groups)
    for line in as_text(result):
        print(line)
    assert out is not None
    out.parent.mkdir(parents=True, exist_ok=True)
    cameras = recording.in_frame(result.cameras)
    write_cameras(out, cameras)
    print(f'\n{len(cameras)} cameras in the frame {recording.frame!r} -> {out}')
    if len(cameras) == 1:
        print('a single camera is only levelled: height, roll and pitch')
    if picture:
        picture.parent.mkdir(parents=True, exist_ok=True)
        write_picture(picture, next(recording.read()), result)
        print(f'before and after -> {picture}')
    if args.ros:
        for line in ('', *as_ros(cameras, recording.frame)):
            print(line)


def _recording(args: Namespace) -> 'Recording':
    """Return the Recording that the arguments name."""
    from hooc_perception.calibration.recordings import of_bags, of_set
    from hooc_perception.cli.sources import is_bag
    from hooc_perception.io.scenes.scene_set import load_scene_set
    bags = [path for path in args.sources if is_bag(path)]
    if len(bags) == len(args.sources):
        if args.scene:
            raise HoocError('--scene chooses scenes of a set; a bag holds one scene, so leave it '
                            'out')
        return of_bags(bags, args.frames)
    if len(args.sources) > 1:
        raise HoocError('name one scene set, or only bags')
    return of_set(load_scene_set(args.sources[0]).selected(args.scene))

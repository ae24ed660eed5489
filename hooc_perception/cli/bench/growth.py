# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""`hooc bench growth`: how processor time and memory of a scene grow."""

from argparse import ArgumentParser, Namespace
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hooc_perception.benchmark.growth import Point

HELP = ('Measure how processor time and memory of a scene grow with the number of views, '
        'categories, objects and pixels, one at a time, and those of a frame set that follows '
        'another with the share of the objects that is gone.')


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument('--model', type=Path, metavar='MODEL',
                        help='model of the profile best or fast (default: the bundled one)')
    parser.add_argument('--profile', choices=('best', 'fast'), help="default: the model's")
    parser.add_argument('--seed', type=int, default=0, help='default: %(default)s')
    parser.add_argument('--json', type=Path, metavar='FILE', help='write all figures as JSON')
    parser.add_argument('--plot', type=Path, metavar='FILE.png', help='write a plot')


def run(args: Namespace) -> None:
    """Measure, print and plot."""
    from hooc_perception.benchmark.growth import grow, write_plot
    from hooc_perception.cli.demo import bundle_root, MODEL
    from hooc_perception.cli.places import file_place
    from hooc_perception.cli.scoring import write_json
    from hooc_perception.trained.folder import load_model_folder
    from tqdm import tqdm
    file_place(args.json, '--json')
    file_place(args.plot, '--plot')
    folder = load_model_folder(args.model or bundle_root() / MODEL)
    profile = args.profile or folder.profile
    grown = grow(folder, profile, args.seed,
                 each=lambda rows: tqdm(rows, desc='scenes', disable=None))
    _print(grown, profile)
    if args.plot:
        write_plot(args.plot, grown, 'One factor varies, the others stay at 20 objects, 25 '
                   f'categories, three Kinect v2 views (dotted); profile {profile}')
        print(args.plot)
    if args.json:
        rows = {axis: [{**vars(p), 'peak_mb': p.peak_mb if p.peak_mb == p.peak_mb else None}
                       for p in points] for axis, points in grown.items()}
        write_json(args.json, {'format': 'hooc-growth/1', 'profile': profile, 'seed': args.seed,
                               'axes': rows})
        print(args.json)


def _print(grown: Mapping[str, Sequence['Point']], profile: str) -> None:
    """Print a row for every point and how each axis grows."""
    from hooc_perception.benchmark.growth import CHANGED, exponent
    from hooc_perception.evaluation.tables import Table, to_text
    rows, notes = [], []
    for axis, points in grown.items():
        rows += [(f'{axis} {p.setting[axis]:g}', f'{p.cpu_s:.2f}', f'{p.peak_mb:.0f}',
                  p.standing, p.candidates, p.found) for p in points]
        if axis != CHANGED:
            notes.append(f'{axis}: time as n^{exponent(points, axis, "cpu_s"):.2f}')
    print(to_text(Table(
        f'Growth of time and memory, profile {profile}',
        ('', 'CPU s', 'peak MB', 'standing', 'candidates', 'found'), tuple(rows),
        ('', 'CPU s: processor seconds of all threads, one scene per row, measured once after '
         'compilation.', 'peak MB: peak memory of the whole process, libraries and model '
         'included. Least squares: ' + ', '.join(notes) + '.'))))

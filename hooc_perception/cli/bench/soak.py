# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""`hooc bench soak`: the nodes for a long time."""

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from hooc_perception.chain import CHAIN
from hooc_perception.errors import HoocError

if TYPE_CHECKING:
    from hooc_perception.benchmark.soak import SoakResult

HELP = ('Run the nodes at 1 Hz while cameras drop out and return, and check that the memory of '
        'every process stays flat. The exit code is 1 if memory grows or a node dies.')
# Growth that is allowed: this many MB, or this share of the median where that is more.
ALLOWED_MB, ALLOWED_SHARE = 20.0, 0.05


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument('--minutes', type=float, default=30.0, metavar='M',
                        help='default: %(default)g')
    parser.add_argument('--bag', type=Path, metavar='BAG',
                        help='scene to play (default: the bundled one)')
    parser.add_argument('--model', type=Path, metavar='MODEL', help='default: the bundled one')
    parser.add_argument('--seed', type=int, default=0, help='default: %(default)s')
    parser.add_argument('--json', type=Path, metavar='FILE', help='write all figures as JSON')
    parser.add_argument('--plot', type=Path, metavar='FILE.png', help='plot memory over time')


def run(args: Namespace) -> int:
    """Run the nodes, print and plot their memory; return the exit code."""
    from hooc_perception.benchmark.soak import soak, write_plot
    from hooc_perception.cli.demo import bundle_root, MODEL, SCENE
    from hooc_perception.cli.places import file_place
    from hooc_perception.cli.scoring import write_json
    from hooc_perception.trained.folder import load_model_folder
    from tqdm import tqdm
    if not 0 < args.minutes <= 1e5:
        raise HoocError(f'--minutes is {args.minutes:g}; give a positive number of minutes')
    file_place(args.json, '--json')
    file_place(args.plot, '--plot')
    bag, model = args.bag or bundle_root() / SCENE, args.model or bundle_root() / MODEL
    load_model_folder(model)
    parameters = {name: {'model': str(Path(model).resolve()), 'seed': args.seed}
                  for name in CHAIN}
    with tqdm(total=round(60 * args.minutes), desc='seconds', disable=None) as bar:
        result = soak(bag, parameters, 60 * args.minutes, seed=args.seed,
                      progress=lambda done: bar.update(int(done) - bar.n))
    flat = _print(result)
    if args.plot:
        write_plot(args.plot, result)
        print(args.plot)
    if args.json:
        write_json(args.json, {
            'format': 'hooc-soak/1', 'minutes': args.minutes, 'frames': result.frames,
            'sets': result.sets, 'answers': result.answers, 'refused': result.refused,
            'deaths': result.deaths, 'seconds': result.seconds.round(1).tolist(),
            'memory_mb': {n: m.round(1).tolist() for n, m in result.memory_mb.items()},
            'reasons': {f'{thing} {reason}': number
                        for (thing, reason), number in sorted(result.reasons.items())}})
        print(args.json)
    return int(not flat or result.deaths > 0)


def _print(result: 'SoakResult') -> bool:
    """Print what a soak has shown; return whether no process grew by more than is allowed."""
    from hooc_perception.evaluation.tables import Table, to_text
    import numpy as np
    rows, flat = [], True
    for name, memory in result.memory_mb.items():
        grown = result.growth_mb(name)
        flat &= grown <= max(ALLOWED_MB, ALLOWED_SHARE * float(np.nanmedian(memory)))
        rows.append((name, f'{memory[0]:.0f}', f'{np.nanmax(memory):.0f}', f'{memory[-1]:.0f}',
                     f'{grown:+.1f}', f'{result.growth_mb_per_hour(name):+.1f}'))
    reasons = ', '.join(f'{thing.partition(": ")[2]} {reason} {number}' for (thing, reason), number
                        in sorted(result.reasons.items()))
    print(to_text(Table(
        f'Memory over {result.seconds[-1] / 60:.1f} minutes, MB',
        ('', 'first', 'most', 'last', 'growth', 'per hour'), tuple(rows),
        (f'{result.frames} images, {result.sets} frame sets, {result.answers} answered, '
         f'{result.refused} rejected, {result.deaths} deaths. Reason counts: {reasons}.',
         'growth: median of the last quarter minus that of the first quarter after warm-up.'))))
    return flat

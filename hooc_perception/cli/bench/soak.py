# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""`hooc bench soak`: the nodes for a long time."""

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import Any, TYPE_CHECKING

from hooc_perception.chain import CHAIN, PARSING
from hooc_perception.errors import HoocError

if TYPE_CHECKING:
    from hooc_perception.benchmark.change_check import ChangeResult
    from hooc_perception.benchmark.soak_result import SoakResult

HELP = ('Run the nodes at 1 Hz while cameras drop out and return, and check that the memory of '
        'every process stays flat; with --changes, also that every change of the table is '
        'answered and that ids stay with their objects. The exit code is 1 if not, or if a node '
        'dies.')
# With changes, everything is decided anew this often, so that it happens between them. [s]
FULL_EVERY_S = 8.0
# Growth that is allowed: this many MB, or this share of the median where that is more.
ALLOWED_MB, ALLOWED_SHARE = 20.0, 0.05


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument('--minutes', type=float, default=30.0, metavar='M',
                        help='default: %(default)g')
    parser.add_argument('--bag', type=Path, metavar='BAG',
                        help='scene to play (default: the bundled one)')
    parser.add_argument('--changes', action='store_true',
                        help='render a table on which an object is put, taken or moved every '
                        'few seconds, instead of playing a scene')
    parser.add_argument('--model', type=Path, metavar='MODEL', help='default: the bundled one')
    parser.add_argument('--seed', type=int, default=0, help='default: %(default)s')
    parser.add_argument('--json', type=Path, metavar='FILE', help='write all figures as JSON')
    parser.add_argument('--plot', type=Path, metavar='FILE.png', help='plot memory over time')


def run(args: Namespace) -> int:
    """Run the nodes, print and plot their memory; return the exit code."""
    from hooc_perception.benchmark.changing_table import ChangingTable, MOST_ALIKE
    from hooc_perception.benchmark.soak import soak
    from hooc_perception.benchmark.soak_result import write_plot
    from hooc_perception.cli.demo import bundle_root, MODEL, SCENE
    from hooc_perception.cli.places import file_place
    from hooc_perception.cli.scoring import write_json
    from hooc_perception.core.geometry import stage_rng
    from hooc_perception.trained.folder import load_model_folder
    from tqdm import tqdm
    if not 0 < args.minutes <= 1e5:
        raise HoocError(f'--minutes is {args.minutes:g}; give a positive number of minutes')
    file_place(args.json, '--json')
    file_place(args.plot, '--plot')
    if args.changes and args.bag:
        raise HoocError('--changes renders a table of its own; leave out --bag')
    model = args.model or bundle_root() / MODEL
    folder = load_model_folder(model)
    parameters = {name: {'model': str(Path(model).resolve()), 'seed': args.seed}
                  for name in CHAIN}
    scene = args.bag or bundle_root() / SCENE
    if args.changes:
        scene = ChangingTable(folder.models, folder.cameras, stage_rng(args.seed, 'soak/table'))
        # Two objects of a category may stand on the table.
        parameters[PARSING].update(full_every_s=FULL_EVERY_S, max_instances=MOST_ALIKE)
    with tqdm(total=round(60 * args.minutes), desc='seconds', disable=None) as bar:
        result = soak(scene, parameters, 60 * args.minutes, seed=args.seed,
                      progress=lambda done: bar.update(int(done) - bar.n))
    good = _print(result)
    if result.changes is not None:
        good &= _print_changes(result.changes)
    if args.plot:
        write_plot(args.plot, result)
        print(args.plot)
    if args.json:
        write_json(args.json, {
            'format': 'hooc-soak/1', 'minutes': args.minutes, 'frames': result.frames,
            'sets': result.sets, 'answers': result.answers, 'refused': result.refused,
            'deaths': result.deaths, 'seconds': result.seconds.round(1).tolist(),
            'memory_mb': {n: m.round(1).tolist() for n, m in result.memory_mb.items()},
            'background_mb': round(result.background_mb, 1),
            'changes': None if result.changes is None else _figures(result.changes),
            'reasons': {f'{thing} {reason}': number
                        for (thing, reason), number in sorted(result.reasons.items())}})
        print(args.json)
    return int(not good or result.deaths > 0)


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
         f'Full parses in the background: at most {result.background_mb:.0f} MB.',
         'growth: of the level to which memory falls back (10th percentile), from the first '
         'quarter after warm-up to the last.'))))
    return flat


def _print_changes(changes: 'ChangeResult') -> bool:
    """Print how changes were answered; return whether all were and no id is wrong."""
    from hooc_perception.evaluation.tables import Table, to_text
    import numpy as np
    rows = []
    for kind in ('put', 'taken', 'moved'):
        mine = [f for f in changes.followed if f.change.kind == kind]
        late = [f.late for f in mine]
        shown = [f.seconds for f in mine if f.late is not None]
        rows.append((kind, str(len(mine)), str(late.count(0)),
                     str(len([n for n in late if n])), str(sum(f in changes.lost for f in mine)),
                     str(sum(not f.answers for f in mine)),
                     f'{np.median(shown):.1f}' if shown else ''))
    print(to_text(Table(
        'Changes', ('', 'all', 'at once', 'later', 'never', 'unanswered', 'seconds'), tuple(rows),
        (f'Objects found: {changes.found} of {changes.true}; where there are none: '
         f'{changes.false}. Ids of another object: {changes.swapped}; new ids of the same object: '
         f'{changes.lost_ids}, and {changes.renamed} because it was taken for another category.',
         'at once: by the answer to the first frame set after the change that was answered. '
         'unanswered: no frame set was answered before the end. seconds: median until the first '
         'answer that shows the change.'))))
    answered = all(f.late is not None for f in changes.followed)
    return answered and not changes.swapped and not changes.lost_ids


def _figures(changes: 'ChangeResult') -> dict[str, Any]:
    """Return the figures of a ChangeResult, for JSON."""
    return {'found': changes.found, 'true': changes.true, 'false': changes.false,
            'swapped': changes.swapped, 'lost_ids': changes.lost_ids, 'renamed': changes.renamed,
            'followed': [{'kind': f.change.kind, 'name': f.change.name, 'stamp_ns': f.stamp_ns,
                          'answers': f.answers, 'late': f.late,
                          'seconds': None if f.late is None else round(f.seconds, 3)}
                         for f in changes.followed]}

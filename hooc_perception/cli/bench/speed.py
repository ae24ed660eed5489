# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""`hooc bench speed`: speed and memory of the stages beside named baselines, in one run."""

from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
import os
from pathlib import Path
import platform
from typing import Any, TYPE_CHECKING

from hooc_perception.cli import options
from hooc_perception.errors import HoocError

if TYPE_CHECKING:
    from hooc_perception.benchmark.chain import ChainTimes
    from hooc_perception.benchmark.live import FollowingTime
    from hooc_perception.benchmark.measure import Contest, Entry
    from hooc_perception.benchmark.scene import BenchScene

HELP = ('Measure the stages of the chain beside named baselines on one synthetic scene of 20 '
        'objects, in one run, and print the times as ratios. Contestants must agree on the '
        'result. Ratios compare across machines, times do not.')
SEARCH = 'search a subset'
MOVED = {'--growth': 'hooc bench growth', '--fuzz': 'hooc bench fuzz --cases N',
         '--soak': 'hooc bench soak --minutes M'}


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument('--stage', action='append', default=[], metavar='NAME',
                        help='only stages whose name contains this (repeatable)')
    parser.add_argument('--model', type=Path, metavar='MODEL',
                        help='also time the whole chain with this model, stage by stage')
    parser.add_argument('--json', type=Path, metavar='FILE', help='write all figures as JSON')
    parser.add_argument('--seed', type=int, default=0, help='default: %(default)s')
    options.add_moved(parser, MOVED)


def run(args: Namespace) -> None:
    """Hold the contests, print and write what they show."""
    from hooc_perception.benchmark import parsing
    from hooc_perception.benchmark.chain import chain_times
    from hooc_perception.benchmark.live import live_times
    from hooc_perception.benchmark.measure import hold
    from hooc_perception.benchmark.scene import bench_scene
    from hooc_perception.cli.places import file_place
    from hooc_perception.cli.scoring import write_json
    from hooc_perception.trained.folder import load_model_folder
    from tqdm import tqdm
    file_place(args.json, '--json')
    chosen = _contests(args.stage, args.seed)
    # A model that cannot be read is better rejected before minutes of work.
    folder = load_model_folder(args.model) if args.model else None
    scene = bench_scene(args.seed)
    entries = [entry for make in tqdm(chosen.values(), desc='stages', disable=None)
               for entry in hold(make(scene))]
    quality = parsing.search_quality(scene, args.seed) if SEARCH in chosen else {}
    _print(entries, quality)
    times = chain_times(folder, scene) if folder else None
    live = live_times(folder, scene, args.seed) if folder else []
    if times:
        _print_chain(times)
        _print_live(live)
    if args.json:
        write_json(args.json, {**_content(entries, quality, times, args.seed),
                               'live': [asdict(time) for time in live]})
        print(args.json)


def _contests(parts: Sequence[str],
              seed: int) -> dict[str, Callable[['BenchScene'], 'Contest']]:
    """
    Return {stage: function that makes its contest}.

    :param parts: only stages whose name contains one of them; none = all.
    """
    from hooc_perception.benchmark import learning, parsing, rendering
    contests: dict[str, Callable[[BenchScene], Contest]] = {
        'undistort an image': rendering.undistortion_contest,
        'render a view': rendering.view_contest,
        'render the candidates': rendering.candidates_contest,
        'classify pixels': lambda scene: learning.forest_contest(seed),
        'align by ICP': lambda scene: learning.icp_contest(scene, seed),
        'energy of a subset': parsing.energy_contest,
        'energies after each flip': parsing.neighbours_contest,
        'overlap of volumes': parsing.overlap_contest,
        SEARCH: lambda scene: parsing.search_contest(scene, seed),
    }
    chosen = {name: make for name, make in contests.items()
              if not parts or any(part in name for part in parts)}
    if not chosen:
        raise HoocError(f'no stage is called {" or ".join(parts)}; choose among '
                        f'{", ".join(contests)}')
    return chosen


def _print(entries: Sequence['Entry'], quality: Mapping[str, float]) -> None:
    """Print the table and what the searches reach."""
    from hooc_perception.evaluation.tables import Table, to_text
    rows: list[tuple[str | None, ...]] = []
    stage = None
    for e in entries:
        if e.stage != stage:
            rows.append((f'{e.stage}: {e.work}', None, None, None))
            stage = e.stage
        rows.append((f'  {e.name}', f'{1000 * e.seconds:.4g}', f'{e.ratio:.3g} x',
                     f'{e.peak_mb:.3g}' if e.peak_mb == e.peak_mb else None))
    notes = ['', 'ms: median wall time of repeated runs after a warm-up run. ratio: speed-up over',
             'the last line of its group. MB: peak memory allocated by Python and numpy, without',
             'the native memory of other libraries.']
    if quality:
        notes.append('Eq. 1 reached: ' + ', '.join(
            f'{name} {value:.4f}' for name, value in quality.items()) + '.')
    print(to_text(Table('Stages beside baselines', ('', 'ms', 'ratio', 'MB'), tuple(rows),
                        tuple(notes))))


def _print_live(times: Sequence['FollowingTime']) -> None:
    """Print the times of incremental parsing beside those of a parse."""
    from hooc_perception.evaluation.tables import Table, to_text
    rows = tuple((t.what, f'{t.seconds:.3f}', f'{t.slowest:.3f}', f'{t.ratio:.3g} x')
                 for t in times)
    print('\n' + to_text(Table(
        'Frame sets that follow others', ('frame set', 's', 'slowest', 'ratio'), rows,
        ('', 's: median wall time. ratio: speed-up over a parse of each frame set by itself.'))))


def _print_chain(times: 'ChainTimes') -> None:
    """Print where the time of the whole chain goes."""
    from hooc_perception.evaluation.tables import Table, to_text
    total = sum(times.seconds.values())
    rows = [(stage, f'{seconds:.3f}', f'{seconds / total:.0%}')
            for stage, seconds in times.seconds.items()]
    print('\n' + to_text(Table(
        f'The chain, profile {times.profile}', ('stage', 's', 'share'),
        (*rows, ('all', f'{total:.3f}', None)),
        (f'{times.candidates} candidates, {times.objects} objects; peak memory of the process '
         f'{times.peak_mb:.0f} MB.',), bold=(len(rows),))))


def _content(entries: Sequence['Entry'], quality: Mapping[str, float],
             times: 'ChainTimes | None', seed: int) -> dict[str, Any]:
    """Return the content of the JSON file."""
    from hooc_perception.evaluation.as_json import plain
    return plain({'format': 'hooc-bench/1', 'seed': seed, 'search_energy': quality,
                  'chain': times,
                  'machine': {'processor': platform.machine(), 'cores': os.cpu_count(),
                              'python': platform.python_version()},
                  'entries': list(entries)})

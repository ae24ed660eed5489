# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""`hooc bench`: speed and memory of the stages beside named baselines, in one run."""

import json
from pathlib import Path

from hooc_perception.chain import CHAIN
from hooc_perception.errors import HoocError

HELP = ('Measure the stages of the chain beside named baselines on one synthetic scene of 20 '
        'objects, in one run, and print the times as ratios. Contestants must agree on the '
        'result. Ratios compare across machines, times do not.')


def add_arguments(parser):
    """Declare the arguments."""
    parser.add_argument('--stage', action='append', default=[], metavar='NAME',
                        help='only stages whose name contains this (repeatable)')
    parser.add_argument('--model', type=Path, metavar='MODEL',
                        help='time the whole chain with this model, too, stage by stage')
    parser.add_argument('--json', type=Path, metavar='FILE', help='write all figures as JSON')
    parser.add_argument('--fuzz', type=int, metavar='N',
                        help='instead: feed N damaged bags, messages and models to all '
                             'that reads them; each has to be read or refused in one sentence')
    parser.add_argument('--soak', type=float, metavar='MINUTES',
                        help='instead: run the nodes at 1 Hz for so long while cameras drop out '
                             'and return, and look whether their memory stays flat')
    parser.add_argument('--growth', action='store_true',
                        help='instead: how processor time and memory of a scene grow with views, '
                             'categories, objects and pixels (--model, default the bundled one; '
                             '--plot, --json)')
    parser.add_argument('--profile', choices=('best', 'fast'),
                        help="profile of --growth (default: the model's)")
    parser.add_argument('--bag', type=Path, metavar='BAG',
                        help='scene for --soak (default: the bundled one)')
    parser.add_argument('--plot', type=Path, metavar='FILE.png',
                        help='draw what --growth measured, or the memory of --soak over time')
    parser.add_argument('--seed', type=int, default=0, help='default: %(default)s')


def run(args):
    """Run the command; return the exit code."""
    from hooc_perception.cli.places import file_place
    file_place(args.json, '--json')
    file_place(args.plot, '--plot')
    if args.fuzz is not None:
        return _fuzz(args.fuzz, args.seed)
    if args.soak is not None:
        return _soak(args)
    if args.growth:
        return _growth(args)
    from hooc_perception.benchmark import learning, parsing, rendering
    from hooc_perception.benchmark.measure import hold
    from hooc_perception.benchmark.scene import bench_scene
    from tqdm import tqdm
    contests = {
        'undistort an image': rendering.undistortion_contest,
        'render a view': rendering.view_contest,
        'render the candidates': rendering.candidates_contest,
        'classify pixels': lambda scene: learning.forest_contest(args.seed),
        'align by ICP': lambda scene: learning.icp_contest(scene, args.seed),
        'energy of a subset': parsing.energy_contest,
        'energies after each flip': parsing.neighbours_contest,
        'overlap of volumes': parsing.overlap_contest,
        'search a subset': lambda scene: parsing.search_contest(scene, args.seed),
    }
    chosen = {name: make for name, make in contests.items()
              if not args.stage or any(part in name for part in args.stage)}
    if not chosen:
        raise HoocError(f'no stage is called {" or ".join(args.stage)}; there are '
                        f'{", ".join(contests)}')
    folder = None
    if args.model:      # a model that cannot be read is better refused before minutes of work
        from hooc_perception.trained.folder import load_model_folder
        folder = load_model_folder(args.model)
    scene = bench_scene(args.seed)
    entries = [entry for name, make in tqdm(chosen.items(), desc='stages', disable=None)
               for entry in hold(make(scene))]
    quality = (parsing.search_quality(scene, args.seed) if 'search a subset' in chosen else {})
    _print(entries, quality)
    times = None
    if folder:
        from hooc_perception.benchmark.chain import chain_times
        times = chain_times(folder, scene)
        _print_chain(times)
    if args.json:
        _write_json(args.json, _content(entries, quality, times, args.seed))


def _fuzz(cases, seed):
    """Run the fuzzer, print what came of it; return the exit code."""
    from hooc_perception.benchmark.fuzz import fuzz, READ, REFUSED
    from hooc_perception.evaluation.tables import Table, to_text
    from tqdm import tqdm
    if cases < 1:
        raise HoocError(f'--fuzz is {cases}; give the number of cases')
    result = fuzz(cases, seed, lambda numbers: tqdm(numbers, desc='cases', disable=None))
    kinds = sorted({kind for kind, _ in result.outcomes})
    rows = tuple((kind, str(result.outcomes[kind, READ]), str(result.outcomes[kind, REFUSED]))
                 for kind in kinds)
    print(to_text(Table('Damaged input', ('', 'read', 'refused'), rows, (
        f'{cases} cases of seed {seed}; {len(result.failures)} failed.',))))
    for number, kind, text in result.failures:
        print(f'case {number} ({kind}): {text}')
    return int(bool(result.failures))


def _growth(args):
    """Measure how time and memory grow, print and draw it."""
    from hooc_perception.benchmark.growth import grow, write_plot
    from hooc_perception.cli.demo import bundle_root, MODEL
    from hooc_perception.trained.folder import load_model_folder
    from tqdm import tqdm
    folder = load_model_folder(args.model or bundle_root() / MODEL)
    profile = args.profile or folder.profile
    grown = grow(folder, profile, args.seed,
                 each=lambda rows: tqdm(rows, desc='scenes', disable=None))
    _print_growth(grown, profile)
    if args.plot:
        write_plot(args.plot, grown, f'A scene of 20 objects, 25 categories, three Kinect v2 '
                   f'views (dotted), and what changes; profile {profile}')
        print(args.plot)
    if args.json:
        rows = {axis: [{**vars(p), 'peak_mb': p.peak_mb if p.peak_mb == p.peak_mb else None}
                       for p in points] for axis, points in grown.items()}
        _write_json(args.json, {'format': 'hooc-growth/1', 'profile': profile,
                                'seed': args.seed, 'axes': rows})
    return 0


def _write_json(path, content):
    """Write figures to a file and say so."""
    from hooc_perception.io.scenes.files import write_atomically
    write_atomically(path, json.dumps(content, indent=1) + '\n')
    print(path)


def _print_growth(grown, profile):
    """Print a row for every point and how each axis grows."""
    from hooc_perception.benchmark.growth import exponent
    from hooc_perception.evaluation.tables import Table, to_text
    rows, notes = [], []
    for axis, points in grown.items():
        rows += [(f'{axis} {p.setting[axis]:g}', f'{p.cpu_s:.2f}', f'{p.peak_mb:.0f}',
                  p.standing, p.candidates, p.found) for p in points]
        notes.append(f'{axis}: time as n^{exponent(points, axis, "cpu_s"):.2f}')
    print(to_text(Table(
        f'Growth of a scene, profile {profile}',
        ('', 'CPU s', 'peak MB', 'standing', 'candidates', 'found'), tuple(rows),
        ('', 'Processor seconds of all threads, one scene a row, measured once; kernels were '
         'compiled before.', 'Peak of the whole process, libraries and model included. '
         'Least squares: ' + ', '.join(notes) + '.'))))


def _soak(args):
    """Run the nodes for a long time, print and draw their memory; return the exit code."""
    from hooc_perception.benchmark.soak import soak, write_plot
    from hooc_perception.cli.demo import bundle_root, MODEL, SCENE
    from hooc_perception.trained.folder import load_model_folder
    from tqdm import tqdm
    if not 0 < args.soak <= 1e5:
        raise HoocError(f'--soak is {args.soak:g}; give the minutes that it may take')
    bag, model = args.bag or bundle_root() / SCENE, args.model or bundle_root() / MODEL
    load_model_folder(model)
    parameters = {name: {'model': str(Path(model).resolve()), 'seed': args.seed}
                  for name in CHAIN}
    with tqdm(total=round(60 * args.soak), desc='seconds', disable=None) as bar:
        result = soak(bag, parameters, 60 * args.soak, seed=args.seed,
                      progress=lambda done: bar.update(int(done) - bar.n))
    flat = _print_soak(result)
    if args.plot:
        write_plot(args.plot, result)
        print(args.plot)
    if args.json:
        _write_json(args.json, {
            'format': 'hooc-soak/1', 'minutes': args.soak, 'frames': result.frames,
            'sets': result.sets, 'answers': result.answers, 'refused': result.refused,
            'deaths': result.deaths,
            'seconds': result.seconds.round(1).tolist(),
            'memory_mb': {n: m.round(1).tolist() for n, m in result.memory_mb.items()},
            'reasons': {f'{thing} {reason}': number
                        for (thing, reason), number in sorted(result.reasons.items())}})
    return int(not flat or result.deaths > 0)


def _print_soak(result, allowed=0.05):
    """Print what a soak has shown; return whether no process grew by more than a share."""
    from hooc_perception.evaluation.tables import Table, to_text
    import numpy as np
    rows, flat = [], True
    for name, memory in result.memory_mb.items():
        grown = result.growth_mb(name)
        flat &= grown <= max(20.0, allowed * float(np.nanmedian(memory)))
        rows.append((name, f'{memory[0]:.0f}', f'{np.nanmax(memory):.0f}', f'{memory[-1]:.0f}',
                     f'{grown:+.1f}', f'{result.growth_mb_an_hour(name):+.1f}'))
    reasons = ', '.join(f'{thing.partition(": ")[2]} {reason} {number}' for (thing, reason), number
                        in sorted(result.reasons.items()))
    print(to_text(Table(
        f'Memory over {result.seconds[-1] / 60:.1f} minutes, MB',
        ('', 'first', 'most', 'last', 'grown', 'an hour'), tuple(rows),
        (f'{result.frames} images, {result.sets} frame sets, {result.answers} answered, '
         f'{result.refused} refused, {result.deaths} deaths. Counted: {reasons}.',
         'Grown: median of the last quarter over that of the first after warming up.'))))
    return flat


def _print(entries, quality):
    """Print the table and what the searches reach."""
    from hooc_perception.evaluation.tables import Table, to_text
    rows, stage = [], None
    for e in entries:
        if e.stage != stage:
            rows.append((f'{e.stage}: {e.work}', None, None, None))
            stage = e.stage
        rows.append((f'  {e.name}', f'{1000 * e.seconds:.4g}', f'{e.ratio:.3g} x',
                     f'{e.peak_mb:.3g}' if e.peak_mb == e.peak_mb else None))
    notes = ['', 'Median wall time of repeated runs after one that warms up. The ratio is how',
             'many times faster than the last line of its group. MB is the peak of what Python',
             'and numpy ask for; the native memory of other libraries is not in it.']
    if quality:
        notes.append('Eq. 1 reached: ' + ', '.join(
            f'{name} {value:.4f}' for name, value in quality.items()) + '.')
    print(to_text(Table('Stages beside baselines', ('', 'ms', 'ratio', 'MB'), tuple(rows),
                        tuple(notes))))


def _print_chain(times):
    """Print where the time of the whole chain goes."""
    from hooc_perception.evaluation.tables import Table, to_text
    total = sum(times.seconds.values())
    rows = [(stage, f'{seconds:.3f}', f'{seconds / total:.0%}')
            for stage, seconds in times.seconds.items()]
    print('\n' + to_text(Table(
        f'The chain, profile {times.profile}', ('stage', 's', 'share'),
        (*rows, ('all', f'{total:.3f}', None)),
        (f'{times.candidates} candidates, {times.objects} objects; the process needed '
         f'{times.peak_mb:.0f} MB at most.',), bold=(len(rows),))))


def _content(entries, quality, times, seed):
    """Return what the JSON file holds."""
    import os
    import platform
    finite = {True: lambda x: x, False: lambda x: None}
    return {'format': 'hooc-bench/1', 'seed': seed, 'search_energy': quality,
            'chain': vars(times) if times else None,
            'machine': {'processor': platform.machine(), 'cores': os.cpu_count(),
                        'python': platform.python_version()},
            'entries': [{key: finite[value == value](value) for key, value in vars(e).items()}
                        for e in entries]}

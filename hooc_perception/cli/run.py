# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""`hooc run`: replayed bags through the five nodes."""

from argparse import ArgumentParser, Namespace
from collections.abc import Iterable, Sequence
from pathlib import Path
import sys
from typing import Any, cast, TYPE_CHECKING

from hooc_perception.chain import CHAIN, INGESTION, PARSING, REPLAY, STAGES_OF
from hooc_perception.cli import options
from hooc_perception.errors import HoocError

if TYPE_CHECKING:
    from hooc_perception.io.bags.reader import BagScene
    from hooc_perception.supervisor.answers import FrameSetResult
    from hooc_perception.supervisor.bags import BagRunner
    from hooc_perception.trained.folder import ModelFolder

# Upper limits of the node parameters `seed` and `wait_for_answer_s`.
LAST_SEED, LONGEST_WAIT_S = 2 ** 31 - 1, 600.0
HELP = ('Find the objects of recorded bags through the five nodes, which run as separate '
        'processes fed by the replay node. Finds the same objects as `hooc parse` and measures '
        'the time the nodes take.')


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the arguments of `hooc run`."""
    parser.add_argument('bags', nargs='+', type=Path, metavar='BAG',
                        help='rosbag2 folder, .mcap or .db3 file, or a folder of bags')
    parser.add_argument('--out', type=Path, required=True, metavar='RESULTS.json',
                        help='results file to write')
    options.add_chain(parser)
    parser.add_argument('--report', type=Path, metavar='DIR',
                        help='write a report with pictures to DIR/report.html')
    parser.add_argument('--record', type=Path, metavar='DIR',
                        help='record all topics as bags DIR/<scene>')
    parser.add_argument('--timeout', type=float, default=300.0, metavar='S',
                        help='time limit per scene, seconds (default: %(default)g)')
    parser.add_argument('--params', type=Path, metavar='FILE',
                        help='YAML file of node parameters, such as config/perception.yaml')
    parser.add_argument('--verbose', action='store_true', help='show everything the nodes log')


def run(args: Namespace) -> int:
    """Run the command; return the exit code."""
    from hooc_perception.cli.categories import warn_of_gap
    from hooc_perception.cli.failures import tell_failures
    from hooc_perception.cli.places import relative_place
    from hooc_perception.io.bags.reader import BagScene
    from hooc_perception.io.bags.sequences import frame_sets
    from hooc_perception.io.scenes.results import write_results
    from hooc_perception.trained.folder import load_model_folder
    if not args.timeout > 0:
        raise HoocError(f'--timeout is {args.timeout:g}; give a positive number of seconds')
    check_places(args)
    model = load_model_folder(args.model)
    bags = [BagScene(path) for path in bag_paths(args.bags)]
    check_bags(bags, args.record)
    for bag in bags:
        if bag.info['categories']:
            warn_of_gap([m.name for m in model.models], bag.info['categories'], bag.path)
    answers, failures, profile, seed = play(bags, args, model)
    # Per frame set of a sequence, or per bag: where it is recorded, and its result.
    done = [(scene, answer) for bag in bags if bag.name in answers
            for scene, answer in zip(frame_sets(bag) or (bag,), answers[bag.name])]
    entries = [entry for bag in bags if bag.name in answers
               for entry in entries_of(bag, answers[bag.name], model, args.out)]
    if done:
        write_results(args.out, done[0][0].info['dataset'], entries, profile=profile, seed=seed,
                      model=relative_place(args.model, args.out))
        found = sum(len(entry['objects']) for entry in entries)
        print(f'{args.out}: {found} objects in {len(entries)} '
              f'scene{"s" if len(entries) != 1 else ""}')
        if args.report:
            write_report(args, bags, done, entries, model,
                         f'Profile {profile}, seed {seed}, through the nodes')
    return tell_failures(failures)


def check_places(args: Namespace) -> None:
    """Raise HoocError where --out, --report or --record cannot be written."""
    from hooc_perception.cli.places import file_place, folder_place, page_place
    file_place(args.out, '--out')
    page_place(args.report, '--report')
    folder_place(args.record, '--record')


def check_bags(bags: 'Sequence[BagScene]', record: Path | None) -> None:
    """Raise HoocError where bags cannot be used, before anything starts."""
    names = [bag.name for bag in bags]
    for bag in bags:
        if names.count(bag.name) > 1:
            raise HoocError(f'two bags hold the scene {bag.name!r}; run them one at a time')
        if record and (record / bag.name).exists():
            raise HoocError(f'--record {record / bag.name} exists already; remove it or choose '
                            'another folder')
        for warning in bag.warnings:
            print(f'warning: {warning}', file=sys.stderr)
        check_table(bag)


def check_table(bag: 'BagScene') -> None:
    """Raise HoocError where no camera of a bag shows the table; warn of those that do not."""
    from hooc_perception.core.segment.observe import observe, require_table
    from hooc_perception.core.segment.rectify import rectify
    try:
        observation = require_table(observe([rectify(view) for view in bag.views()]))
    except HoocError as error:
        at = '' if str(bag.path) in str(error) else f'{bag.path}: '
        raise HoocError(f'{at}{error}') from None
    for sentence in observation.troubles:
        print(f'warning: {bag.path}: {sentence}', file=sys.stderr)


def bag_paths(given: Iterable[Path]) -> list[Path]:
    """Return the given bags, a folder of bags replaced by what it holds."""
    from hooc_perception.io.bags.folder import is_bag
    paths: list[Path] = []
    for path in given:
        inside = sorted(p for p in path.iterdir() if is_bag(p)) if (
            path.is_dir() and not is_bag(path)) else []
        paths += inside or [path]
    return paths


def chain_parameters(args: Namespace, model: 'ModelFolder') -> dict[str, dict[str, Any]]:
    """
    Return {node: parameters} of the chain from --profile, --seed and --set-parameter.

    What was not given is left to the user's file and then to the model: see `model_defaults`.

    :raises HoocError: where a parameter is unknown, or its value is rejected.
    """
    from hooc_perception.cli.overrides import overrides_of
    from hooc_perception.core import profiles
    seed = model.seed if args.seed is None else args.seed
    if not 0 <= seed <= LAST_SEED:
        raise HoocError(f'the seed is {seed}; give --seed a number from 0 to {LAST_SEED}')
    common = {'model': str(args.model.resolve()), 'profile': args.profile, 'seed': args.seed}
    parameters: dict[str, dict[str, Any]] = {
        name: {key: value for key, value in common.items() if value is not None}
        for name in CHAIN}
    overrides = overrides_of(getattr(args, 'set_parameter', ()))
    changed = profiles.with_overrides(profiles.profile(args.profile or model.profile), overrides)
    for key in overrides:
        stage, _, name = key.partition('.')
        for node in (n for n in CHAIN if stage in STAGES_OF[n]):
            # As the Config holds it: 2 for a float has become 2.0, which ROS requires.
            parameters[node][key] = changed.stage(stage).values()[name]
    return parameters


def model_defaults(model: 'ModelFolder') -> dict[str, dict[str, Any]]:
    """Return {node: parameters} of the chain that apply unless something else is given."""
    return {name: {'profile': model.profile, 'seed': model.seed} for name in CHAIN}


def play(bags: 'Sequence[BagScene]', args: Namespace, model: 'ModelFolder',
         ) -> 'tuple[dict[str, list[FrameSetResult]], dict[str, HoocError], str, int]':
    """
    Play all bags through the nodes.

    :return: ({bag: [FrameSetResult]}, {bag: HoocError}, profile, seed); the last two as the
        nodes report them.
    """
    from hooc_perception.supervisor.bags import BagRunner, MATCH_TIMEOUT_S
    from hooc_perception.supervisor.supervisor import Supervisor
    from tqdm import tqdm
    parameters = chain_parameters(args, model)
    # A recorded frame set is complete, however long it waits.
    parameters[INGESTION].update(max_frame_age_s=0.0,
                                 wait_for_answer_s=min(args.timeout, LONGEST_WAIT_S))
    parameters[REPLAY] = {'match_timeout_s': MATCH_TIMEOUT_S}
    with Supervisor((*CHAIN, REPLAY), parameters, isolated=True, verbose=args.verbose,
                    params_file=args.params, defaults=model_defaults(model)) as supervisor:
        runner = BagRunner(supervisor, args.timeout, getattr(args, 'record', None))
        used = supervisor.get_parameters(PARSING, ('profile', 'seed'))
        done = play_all(runner, tqdm(bags, desc='scenes', unit='scene', disable=None))
    return *done, cast(str, used['profile']), cast(int, used['seed'])


def play_all(runner: 'BagRunner', bags: 'Iterable[BagScene]',
             ) -> 'tuple[dict[str, list[FrameSetResult]], dict[str, HoocError]]':
    """Return the results and errors by bag; after a failure the next bag follows."""
    answers: dict[str, list[FrameSetResult]] = {}
    failures: dict[str, HoocError] = {}
    over = None
    for bag in bags:
        if over:
            failures[bag.name] = HoocError('it was not played because the nodes had failed '
                                           f'({over})')
            continue
        try:
            answers[bag.name] = results_of(runner, bag)
        except HoocError as error:
            failures[bag.name] = error
            try:
                runner.start_over()
            except HoocError as trouble:
                over = trouble
    return answers, failures


def results_of(runner: 'BagRunner', bag: 'BagScene') -> 'list[FrameSetResult]':
    """Return the results of all frame sets of a sequence, or of the last one of another bag."""
    last = runner.play(bag)
    if bag.info['sequence'] is None:
        return [last]
    results, expected = runner.results, len(bag.info['sequence']['frame_sets'])
    if len(results) != expected:
        raise HoocError(f'{bag.path}: {len(results)} of the {expected} frame sets of the sequence '
                        'were answered; --verbose shows what the nodes say')
    return results


def entries_of(bag: 'BagScene', answers: 'Sequence[FrameSetResult]', model: 'ModelFolder',
               out: Path) -> list[dict[str, Any]]:
    """Return the results entries of a bag, with events if it is a sequence."""
    from hooc_perception.cli.places import relative_place
    from hooc_perception.io.bags.sequences import frame_sets
    from hooc_perception.supervisor.answers import events_between
    names = [scene.name for scene in frame_sets(bag) or (bag,)]
    entries = [answer.entry(name, [m.name for m in model.models],
                            bag=relative_place(bag.path, out), **bag.world)
               for name, answer in zip(names, answers)]
    if bag.info['sequence'] is None:
        return entries
    return [entry | {'events': events}
            for entry, events in zip(entries, events_between(answers, model.models))]


def write_report(args: Namespace, bags: 'Iterable[BagScene]',
                 done: 'Sequence[tuple[BagScene, FrameSetResult]]',
                 entries: Sequence[dict[str, Any]], model: 'ModelFolder', note: str) -> None:
    """Write DIR/report.html from what the nodes have published."""
    from hooc_perception.evaluation.report.page import write_report as write_page
    from hooc_perception.evaluation.report.scene import report_scene
    from hooc_perception.evaluation.report.sequence import in_sequences
    from hooc_perception.io.bags.sequences import recorded_sequence
    models = {m.name: m for m in model.models}
    scenes = [report_scene(entry, scene.views(answer.images), models, scene.truth,
                           probabilities=answer.probabilities, pool=answer.parsed.pool)
              for entry, (scene, answer) in zip(entries, done)]
    title = f'Objects on the table: {done[0][0].info["dataset"]}'
    sequences = [sequence for bag in bags if (sequence := recorded_sequence(bag))]
    print(write_page(args.report, in_sequences(scenes, sequences), title, [note]))

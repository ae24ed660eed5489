# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""`hooc parse`: the whole chain over a scene set or a bag in one process, no ROS."""

from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from itertools import repeat
from pathlib import Path
import sys
import time
from typing import Any, TYPE_CHECKING

from hooc_perception.cli import options
from hooc_perception.errors import HoocError

if TYPE_CHECKING:
    from hooc_perception.io.bags.reader import BagScene
    from hooc_perception.io.scenes.scene import RecordedScene
    from hooc_perception.parser import Parser

HELP = 'Find the objects of a scene set or a bag, in one process without ROS.'


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument('set', help='folder of a scene set, a BOP dataset or a bag')
    parser.add_argument('--out', required=True, help='results file to write')
    options.add_chain(parser)
    parser.add_argument('--scene', nargs='+', action='extend',
                        metavar='ID', help='only these scenes')
    parser.add_argument('--true-poses', action='store_true',
                        help='setting B: the true poses are among the candidates')
    parser.add_argument('--sigmas', action='store_true',
                        help='also estimate the uncertainty of each pose')
    parser.add_argument('--incremental', action='store_true',
                        help='each frame set of a sequence follows the one before, as in the '
                        'nodes; objects have lasting ids (a set without sequences is one)')
    options.add_executor(parser)


def run(args: Namespace) -> int | None:
    """Parse every scene, write the results of those that could be; return the exit code."""
    from hooc_perception.cli.categories import category_gap, warn_of_gap
    from hooc_perception.cli.failures import tell_failures
    from hooc_perception.cli.incremental import in_time_order, updates
    from hooc_perception.cli.overrides import overrides_of
    from hooc_perception.cli.places import file_place
    from hooc_perception.cli.sources import load_source, provenance
    from hooc_perception.executor import executor, spread
    from hooc_perception.io.scenes.results import scene_entry, write_results
    from hooc_perception.parser import Parser
    from hooc_perception.trained.folder import load_model_folder
    from tqdm import tqdm

    file_place(args.out, '--out')
    out = Path(args.out)
    folder = load_model_folder(args.model)
    scene_set = load_source(args.set, folder)
    of_file, of_scene = provenance(scene_set, args.model, out)
    names = [m.name for m in folder.models]
    parser = Parser.load(folder, args.profile, parameters=overrides_of(args.set_parameter),
                         max_instances=scene_set.max_instances, sigmas=args.sigmas)
    seed = folder.seed if args.seed is None else args.seed
    selected = scene_set.selected(args.scene)
    scenes: Sequence[Any] = selected.scenes
    if args.incremental:
        if args.true_poses or args.executor != 'local':
            raise HoocError('--incremental parses one frame set after the other; leave out '
                            + ('--true-poses' if args.true_poses else '--executor'))
        scenes = in_time_order(scenes, selected.sequences)
    if args.true_poses:
        _check_true_poses(scenes, names, category_gap(names, scene_set.category_names, args.set))
    else:
        warn_of_gap(names, scene_set.category_names, args.set)
    setting = 'B' if args.true_poses else 'A'
    results: list[dict[str, Any]] = []
    failures: dict[str, HoocError] = {}
    with executor(args.executor):
        # One scene at a time on the cores at hand, which the stages share out between them.
        read = (_read(s, args.true_poses) for s in scenes)
        done = (updates(parser, seed, scenes, read, selected.sequences) if args.incremental
                else spread(_parsed, repeat(parser), repeat(seed), read))
        progress = tqdm(total=len(scenes), desc='parsing', unit='scene', disable=None)
        for scene, (parsed, seconds) in zip(scenes, done):
            progress.update()
            if isinstance(parsed, HoocError):
                failures[scene.name] = parsed
                continue
            for warning in parsed.get('warnings', ()):
                progress.write(f'[WARN] scene {scene.name}: {warning}', file=sys.stderr)
            results.append(scene_entry(scene.name, parsed, seconds, profile=parser.profile.name,
                                       seed=seed, setting=setting, **scene.world, **of_scene))
        progress.close()
    if results or not failures:
        write_results(out, scene_set.name, results, setting=setting, **of_file)
        print(f'{len(results)} scenes, {sum(len(r["objects"]) for r in results)} objects -> '
              f'{args.out}')
    return tell_failures(failures)


def _check_true_poses(scenes: 'Sequence[RecordedScene | BagScene]', known: Sequence[str],
                      gap: str | None) -> None:
    """Reject scenes whose true poses cannot all be among the candidates."""
    for scene in scenes:
        if scene.source_truth is None:
            raise HoocError(f'scene {scene.name} has no ground_truth.yaml, which --true-poses '
                            'needs; leave the option out')
        if any(true.category not in known for true in scene.source_truth):
            raise HoocError(f'--true-poses: {gap}')


def _read(scene: 'RecordedScene | BagScene', with_truth: bool) -> Any:
    """Return (DepthViews, truth or None) of a scene, or the HoocError that it gave."""
    try:
        return scene.depth(), scene.truth if with_truth else None
    except HoocError as error:
        return error


def _parsed(parser: 'Parser', seed: int, read: Any) -> tuple[Any, float]:
    """
    Return (dict of the Scene, seconds), or (HoocError, NaN) where it cannot be parsed.

    :param read: what `_read` gave; the truth makes it setting B.
    """
    from hooc_perception.evaluation.true_poses import with_true_poses
    if isinstance(read, HoocError):
        return read, float('nan')
    views, truth = read
    change = None if truth is None else with_true_poses(truth, parser.models)
    start = time.monotonic()
    try:
        scene = parser.parse(views, seed, change)
        return scene.to_dict(), time.monotonic() - start
    except HoocError as error:
        return error, float('nan')

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""`hooc demo`: the bundled scene through the five nodes, beside the ground truth."""

from argparse import ArgumentParser, Namespace
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
import shutil
import site
import sys
import tempfile
from typing import Any, TYPE_CHECKING

from hooc_perception.cli import options
from hooc_perception.errors import HoocError

if TYPE_CHECKING:
    from hooc_perception.core.types import GenericModel
    from hooc_perception.evaluation.tables import Table
    from hooc_perception.io.scenes.scene_set import TrueObject

HELP = ('Replay the bundled scene through the five nodes as separate processes, print the '
        'objects found beside the ground truth, and write a report with pictures.')
SCENE, MODEL = Path('bags') / 'demo', Path('models') / 'demo'
# The bundled scene is from a synthetic set that no benchmark uses.
TWIN_SEED, TWIN_SCENE = 2016, '10_1'


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument('--out', type=Path, default=Path('out/demo'), metavar='DIR',
                        help='folder for the results and the report (default: %(default)s)')
    options.add_profile(parser, 'best')
    parser.add_argument('--seed', type=int, help="default: the model's")
    parser.add_argument('--timeout', type=float, default=300.0, metavar='S',
                        help='time limit, seconds (default: %(default)g)')
    parser.add_argument('--verbose', action='store_true', help='show everything the nodes log')
    parser.add_argument('--make-bundle', action='store_true',
                        help='first rebuild the bundled scene and model from their seeds (takes '
                        'as long as hooc train)')


def run(args: Namespace) -> int:
    """Run the command; return the exit code."""
    from hooc_perception.cli.places import folder_place
    folder_place(args.out, '--out')
    root = bundle_root(must_exist=not args.make_bundle)
    if args.make_bundle:
        make_bundle(root)
    from hooc_perception.cli import run as run_command
    from hooc_perception.evaluation.tables import to_text
    from hooc_perception.io.bags.reader import BagScene
    from hooc_perception.io.scenes.results import load_results
    from hooc_perception.trained.folder import load_model_folder
    results = args.out / 'results.json'
    if run_command.run(_run_arguments(args, root, results)):
        return 1
    models = {model.name: model for model in load_model_folder(root / MODEL).models}
    entry = load_results(results)['scenes'][0]
    print('\n' + to_text(comparison(entry, BagScene(root / SCENE).truth or (), models)))
    print(f'\nresults: {results.resolve()}\nreport:  {(args.out / "report.html").resolve()}')
    return 0


def _run_arguments(args: Namespace, root: Path, results: Path) -> Namespace:
    """Return the arguments of `hooc run` for the bundle, with its own defaults."""
    from hooc_perception.cli import run as run_command
    parser = ArgumentParser()
    run_command.add_arguments(parser)
    words = [root / SCENE, '--model', root / MODEL, '--out', results, '--report', args.out,
             '--timeout', args.timeout]
    words += ['--seed', args.seed] if args.seed is not None else []
    words += ['--profile', args.profile]
    words += ['--verbose'] if args.verbose else []
    return parser.parse_args([str(word) for word in words])


def bundle_root(must_exist: bool = True) -> Path:
    """
    Return the folder that holds the bundled scene and model: the source tree, or share/.

    :raises HoocError: where no place holds them and `must_exist`.
    """
    source = Path(__file__).resolve().parents[2]
    # pip puts the data of a wheel below sys.prefix (below the user's base with --user), colcon
    # below <prefix>, with the package in <prefix>/lib/python3.x/site-packages.
    prefixes = [Path(sys.prefix), Path(site.getuserbase()), *list(source.parents)[2:3]]
    for place in [source, *(prefix / 'share' / 'hooc_perception' for prefix in prefixes)]:
        if (place / SCENE / 'metadata.yaml').is_file() and (place / MODEL).is_dir():
            return place
    if must_exist:
        raise HoocError(f'the bundled scene and model are not in {source}; create them with '
                        '"make bundle" in the source tree')
    return source


def make_bundle(root: Path) -> None:
    """
    Rebuild the bundled scene and model in `root`; the same code gives the same bundle.

    The model is trained on generic meshes and cameras, in the small size of profile `fast`; the
    scene is not part of the training.
    """
    from hooc_perception.io.bags.writer import write_bag
    from hooc_perception.io.scenes.scene_set import load_scene_set
    from hooc_perception.synthesis.twin import TwinOptions, write_twin
    from hooc_perception.training.train import train
    with tempfile.TemporaryDirectory() as folder:
        twin = Path(folder) / 'twin'
        write_twin(twin, TWIN_SEED, TwinOptions(scenes=(TWIN_SCENE,)), progress=True)
        scene_set = load_scene_set(twin)
        train(scene_set, root / MODEL, 'fast', seed=0)
        shutil.rmtree(root / SCENE, ignore_errors=True)
        write_bag(replace(scene_set.scenes[0], name=SCENE.name), scene_set, root / SCENE.parent)
    size = sum(path.stat().st_size for part in (SCENE, MODEL)
               for path in (root / part).rglob('*') if path.is_file())
    print(f'bundle: {root / SCENE} and {root / MODEL}, {size / 1e6:.1f} MB together')


def comparison(entry: Mapping[str, Any], truth: 'Sequence[TrueObject]',
               models: 'Mapping[str, GenericModel]') -> 'Table':
    """
    Return the Table of the objects found beside the ground truth.

    :param entry: one scene of a results file.
    :param truth: sequence of TrueObject.
    :param models: {category: GenericModel}.
    """
    from hooc_perception.evaluation.matching import posed
    from hooc_perception.evaluation.scores import score_objects
    from hooc_perception.evaluation.tables import Table
    estimates = [posed(found) for found in entry['objects']]
    scores = score_objects(estimates, [posed(true) for true in truth], models)
    matched = {score.estimate for score in scores}
    rows = []
    for score in scores:
        i = score.estimate
        rows.append((score.category, 'no' if i is None else 'yes',
                     'yes' if score.localized else 'no',
                     None if i is None else f'{1000 * score.centre_m:.0f}',
                     None if i is None else estimates[i].score))
    false = [estimate for i, estimate in enumerate(estimates) if i not in matched]
    rows += [(estimate.category, 'false positive', None, None, estimate.score)
             for estimate in false]
    count = len(scores)
    n_found = sum(score.estimate is not None for score in scores)
    n_placed = sum(score.localized for score in scores)
    return Table(
        'Objects found beside the ground truth',
        ('object', 'found', 'localized', 'error mm', 'score'), tuple(rows), (
            '',
            f'{n_found} of {count} found, {n_placed} localized, {len(false)} false positives; '
            f'{entry["seconds"]:.1f} s from the last image to the result.',
            "Localized: the centre is within half the generic model's size of the true one."))

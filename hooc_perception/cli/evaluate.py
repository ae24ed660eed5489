# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""`hooc evaluate`: the paper's tables and the stricter scores."""

from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from hooc_perception.cli import options
from hooc_perception.errors import HoocError

if TYPE_CHECKING:
    from hooc_perception.core.types import Energy
    from hooc_perception.evaluation.evaluate import Evaluation
    from hooc_perception.evaluation.tables import Table
    from hooc_perception.evaluation.visibility import Visibility
    from hooc_perception.io.scenes.scene_set import SceneSet
    from hooc_perception.trained.folder import ModelFolder

HELP = ("Score results against the ground truth of a scene set: the paper's Tables 1-4 and "
        'stricter scores (centre within 2 cm, rotation up to symmetry, size and surface, '
        'certain but wrong estimates, calibration of the scores). Scenes with instance labels but '
        'no poses are scored by masks, and by category where labels.yaml has it. Several results '
        'files are shown side by side; without results, Table 1 is printed in full.')
MOVED = {
    '--stages': 'hooc stages SET --model MODEL',
    '--executor': 'hooc stages SET --model MODEL --executor WHERE',
    '--baseline': 'hooc baseline SET --method fpfh|ppf --out RESULTS.json',
    '--out': 'hooc baseline SET --method fpfh|ppf --out RESULTS.json',
    '--seed': 'hooc baseline SET --seed N; scores themselves always use seed 0',
    '--worst': 'hooc worst SET RESULTS.json --count N --out DIR',
    '--stages-from': 'hooc worst SET RESULTS.json --out DIR --stages STAGES.json',
    '--bop-csv': 'hooc export SET RESULTS.json --out FILE.csv',
    '--visibility': 'hooc evaluate SET without results to print Table 1 in full',
}


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument('set', metavar='SET', help='scene set or BOP dataset with ground truth')
    parser.add_argument('results', metavar='RESULTS.json', nargs='*',
                        help='results of hooc parse, hooc run or hooc baseline')
    options.add_scene(parser)
    parser.add_argument('--bop', action='store_true',
                        help="compute BOP's average recalls of VSD, MSSD and MSPD (slower)")
    parser.add_argument('--model', metavar='MODEL',
                        help='model folder that gave the results: adds the energy of the true '
                        'poses to Table 4, and draws objects with the meshes of its families')
    parser.add_argument('--json', metavar='FILE', help='write all scores as JSON')
    parser.add_argument('--markdown', metavar='FILE', help='write the tables as Markdown')
    parser.add_argument('--plots', metavar='DIR',
                        help='write plots of the scores (PNG), with a reliability diagram')
    options.add_moved(parser, MOVED)


def run(args: Namespace) -> None:
    """Score, print and write the tables."""
    from hooc_perception.cli.places import file_place, folder_place
    from hooc_perception.cli.scoring import load_matching, print_tables, write_json
    from hooc_perception.evaluation.as_json import as_json
    from hooc_perception.evaluation.evaluate import evaluate_results, scoring_models, table_1
    from hooc_perception.io.scenes.scene_set import load_scene_set
    from hooc_perception.trained.folder import load_model_folder

    file_place(args.json, '--json')
    file_place(args.markdown, '--markdown')
    folder_place(args.plots, '--plots')
    whole_set = load_scene_set(args.set)
    scene_set = whole_set.selected(args.scene)
    contents = [load_matching(path, whole_set) for path in args.results]
    folder = load_model_folder(args.model) if args.model else None
    models = scoring_models(scene_set, trained=folder.models if folder else ())
    visibility = table_1(scene_set, models)
    evaluations = [evaluate_results(scene_set, content, models, label,
                                    visibility if args.bop else None)
                   for label, content in zip(_labels(args.results), contents)]
    truth_energy = _truth_energy(scene_set, folder) if folder else {}
    tables = _tables(evaluations, scene_set, visibility, truth_energy)
    full = _visibility_tables(visibility)
    if not tables:
        raise HoocError(f'{args.set}: no scene has true poses or instance labels; there is '
                        'nothing to score against')
    print_tables(tables if contents else [*full, *tables], args.markdown,
                 full if contents else ())
    write_json(args.json, as_json(scene_set, evaluations, visibility, truth_energy))
    if args.plots:
        from hooc_perception.evaluation.plots import write_plots
        write_plots(args.plots, [e for e in evaluations if e.scores], scene_set.category_names)


def _labels(paths: Sequence[str]) -> list[str]:
    """Return a short label for each results file, unlike the others'."""
    files = [Path(path) for path in paths]
    stems = [file.stem for file in files]
    if len(set(stems)) == len(stems):
        return stems
    return [f'{file.parent.name}/{file.stem}' for file in files]


def _truth_energy(scene_set: 'SceneSet', folder: 'ModelFolder') -> dict[str, 'Energy']:
    """Return {scene: Energy of the true poses}; the classifier of a model folder is needed."""
    from hooc_perception.cli.categories import warn_of_gap
    from hooc_perception.evaluation.rerun import rerun
    warn_of_gap([m.name for m in folder.models], scene_set.category_names, scene_set.path)
    return rerun(scene_set, folder)[0]


def _tables(evaluations: Sequence['Evaluation'], scene_set: 'SceneSet',
            visibility: dict[str, list['Visibility']],
            truth_energy: dict[str, 'Energy']) -> list['Table']:
    """Return every table that there are figures for."""
    from hooc_perception.evaluation import (
        certainty,
        named_masks,
        open_world,
        paper_tables,
        sequences,
    )
    from hooc_perception.evaluation.shape_table import shape_table

    tables: list[Table | None] = [
        paper_tables.visibility_summary(visibility) if visibility else None,
        *(paper_tables.score_table(evaluations, setting) for setting in 'AB')]
    if any(e.scores for e in evaluations):
        tables += [paper_tables.paper_scores(),
                   paper_tables.energy_table(evaluations, truth_energy),
                   paper_tables.strict_table(evaluations), shape_table(evaluations),
                   open_world.open_table([(e.label, e.open_world) for e in evaluations]),
                   *sequences.tables_of([(e.label or 'results', sequences.summary(e.sequences))
                                         for e in evaluations if e.sequences])]
    for e in evaluations:
        if e.scores:
            tables += [paper_tables.category_table(e, scene_set.category_names),
                       certainty.score_table(e), certainty.sigma_table(e)]
        tables.append(paper_tables.mask_table(e))
    named = {e.label: e.named for e in evaluations if e.named}
    tables += [named_masks.named_table(named),
               *(named_masks.mistakes_table(label, s) for label, s in named.items())]
    return [table for table in tables if table]


def _visibility_tables(visibility: dict[str, list['Visibility']]) -> list['Table']:
    """Return Table 1 of every scene and the paper's own."""
    from hooc_perception.evaluation import paper_tables
    if not visibility:
        return []
    return [*(paper_tables.visibility_table(name, rows) for name, rows in visibility.items()),
            paper_tables.paper_visibility()]

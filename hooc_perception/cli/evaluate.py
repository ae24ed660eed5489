# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""`hooc evaluate`: the paper's tables and the stricter scores."""

import json
from pathlib import Path
import sys

from hooc_perception.cli import executor_option
from hooc_perception.errors import HoocError

HELP = ("Score results against the truth of a scene set: the paper's Tables 1-4, stricter scores "
        "(centre within 2 cm, rotation up to symmetry, BOP's recalls) and, for scenes with "
        'instance labels but no poses, masks. Several results files stand side by side.')


def add_arguments(parser):
    """Declare the arguments."""
    parser.add_argument('set', metavar='SET', help='scene set or BOP dataset with the truth')
    parser.add_argument('results', metavar='RESULTS.json', nargs='*',
                        help='results of `hooc parse` or `hooc run`; none: Table 1 alone')
    parser.add_argument('--scene', metavar='ID', action='append', default=[],
                        help='score this scene only (repeatable)')
    parser.add_argument('--bop', action='store_true',
                        help="compute BOP's average recalls of VSD, MSSD and MSPD (slower)")
    parser.add_argument('--visibility', action='store_true',
                        help='print Table 1 of every annotated scene in full')
    parser.add_argument('--model', metavar='MODEL',
                        help="model folder: adds the truth's energy to Table 4")
    parser.add_argument('--stages', action='store_true',
                        help='run the chain of --model again and say what the classifier, the '
                        'candidates and the parsing lose')
    parser.add_argument('--baseline', metavar='NAME', choices=('fpfh', 'ppf'),
                        help='run a baseline first and score it too: fpfh = FPFH features, '
                        'RANSAC and ICP per category (Open3D); ppf = point pair features (OpenCV)')
    parser.add_argument('--out', metavar='FILE',
                        help="where the baseline's results go (default: NAME.json)")
    parser.add_argument('--seed', type=int, default=0, help='seed of whatever is drawn')
    parser.add_argument('--json', metavar='FILE', help='write every score as JSON')
    parser.add_argument('--markdown', metavar='FILE', help='write the tables as Markdown')
    parser.add_argument('--plots', metavar='DIR', help='write pictures of the scores (PNG)')
    parser.add_argument('--worst', metavar='N', type=int, default=0,
                        help='draw the N scenes of the (first) results of which least was '
                        'localized into --plots, and say why: worst.png, worst.json, worst.md')
    parser.add_argument('--stages-from', metavar='SCORES.json',
                        help='scores of an earlier --stages --json, so that --worst knows what '
                        'candidates there were')
    parser.add_argument('--bop-csv', metavar='FILE',
                        help="write the (first) results in BOP's CSV format")
    executor_option.add_argument(parser)


def run(args):
    """Run the command; return the exit code."""
    from hooc_perception.cli.categories import warn_of_gap
    from hooc_perception.evaluation.evaluate import evaluate_results, scoring_models, table_1
    from hooc_perception.io.scenes.results import load_results
    from hooc_perception.io.scenes.scene_set import load_scene_set
    from hooc_perception.trained.folder import load_model_folder

    if args.stages and not args.model:
        raise HoocError('--stages runs the chain again and needs a trained model; '
                        'give its folder with --model')
    if args.worst < 0 or args.worst and not args.plots:
        raise HoocError('--worst draws pictures of that many scenes; give a number from 1 on, '
                        'and the folder for them with --plots')
    if args.stages_from and not args.worst:
        raise HoocError('--stages-from serves --worst alone; say how many scenes that shall draw')
    if args.bop_csv and not (args.results or args.baseline):
        raise HoocError('--bop-csv needs a results file to write; name one')
    _check_places(args)
    folder = load_model_folder(args.model) if args.model else None
    whole_set = load_scene_set(args.set)
    scene_set = whole_set.selected(args.scene)
    if folder:
        warn_of_gap([m.name for m in folder.models], scene_set.category_names, args.set)
    contents = [load_results(path) for path in args.results]
    for path, content in zip(args.results, contents):
        _check_match(path, content, whole_set)
    labels = _labels(args.results)
    models = scoring_models(scene_set, args.seed)
    if args.baseline:
        path, content = _baseline(args, scene_set, models)
        labels, contents = [*labels, path.stem], [*contents, content]
    visibility = table_1(scene_set, models, args.seed)
    evaluations = [evaluate_results(scene_set, content, models, label,
                                    visibility if args.bop else None)
                   for label, content in zip(labels, contents)]
    if args.worst and not (evaluations and evaluations[0].scores):
        raise HoocError('--worst needs results of scenes with true poses; name a results file of '
                        'such a set')
    truth_energy, stages = {}, {}
    if folder:
        from hooc_perception.evaluation.rerun import rerun
        from hooc_perception.executor import executor, spread
        with executor(args.executor):
            truth_energy, stages = rerun(scene_set, folder, args.stages, spread)
    tables = _tables(evaluations, scene_set, visibility, truth_energy, stages)
    if args.visibility or not contents:
        tables = [*_visibility_tables(visibility), *tables]
    _write(args, evaluations, contents, tables, scene_set, visibility, truth_energy, stages)
    if args.worst:
        _draw_worst(args, scene_set, evaluations, models, stages)
    return 0


def _check_places(args):
    """Raise HoocError where an output cannot be written: better than after the work."""
    from hooc_perception.cli.places import file_place, folder_place
    for name in ('json', 'markdown', 'bop_csv'):
        file_place(getattr(args, name), f'--{name.replace("_", "-")}')
    folder_place(args.plots, '--plots')
    if args.baseline:
        file_place(_baseline_place(args), '--out')


def _check_match(path, content, scene_set):
    """Refuse results that have no scene in common with the set; say what is not scored."""
    from hooc_perception.io.scenes.results import scenes_in_common
    known = {scene.name for scene in scene_set.scenes}
    _, others = scenes_in_common(content, known, path, scene_set.path)
    if others:
        print(f'[WARN] {path}: {others} not in {scene_set.path} and left out', file=sys.stderr)
    if content['dataset'] != scene_set.name:
        print(f'[WARN] {path} is of the dataset {content["dataset"]!r}, {scene_set.path} is '
              f'{scene_set.name!r}', file=sys.stderr)


def _labels(paths):
    """Return a short label for each results file, unlike the others'."""
    paths = [Path(p) for p in paths]
    stems = [p.stem for p in paths]
    if len(set(stems)) == len(stems):
        return stems
    return [f'{p.parent.name}/{p.stem}' for p in paths]


def _baseline_place(args):
    """Return where the baseline's results go."""
    return Path(args.out or f'{args.baseline}.json')


def _baseline(args, scene_set, models):
    """Run the baseline; return (path, content) of its results."""
    from hooc_perception.evaluation.baselines import run_baseline
    from hooc_perception.io.scenes.results import load_results
    path = _baseline_place(args)
    run_baseline(args.baseline, scene_set, models, path, args.seed)
    return path, load_results(path)


def _tables(evaluations, scene_set, visibility, truth_energy, stages):
    """Return every table that the inputs give."""
    from hooc_perception.evaluation import certainty, paper_tables, stage_tables

    tables = [paper_tables.visibility_summary(visibility)] if visibility else []
    tables += [paper_tables.score_table(evaluations, setting) for setting in 'AB']
    if any(e.scores for e in evaluations):
        tables.append(paper_tables.paper_scores())
        tables.append(paper_tables.energy_table(evaluations, truth_energy))
        tables.append(paper_tables.strict_table(evaluations))
    for e in evaluations:
        if e.scores:
            tables.append(paper_tables.category_table(e, scene_set.category_names))
            tables += [certainty.score_table(e), certainty.sigma_table(e)]
        tables.append(paper_tables.mask_table(e))
    if stages:
        tables.append(stage_tables.stage_table(stages))
        tables.append(stage_tables.stage_category_table(stages, scene_set.category_names))
    return [table for table in tables if table]


def _visibility_tables(visibility):
    """Return Table 1 of every scene and the paper's own."""
    from hooc_perception.evaluation import paper_tables
    if not visibility:
        return []
    return [*(paper_tables.visibility_table(name, rows) for name, rows in visibility.items()),
            paper_tables.paper_visibility()]


def _write(args, evaluations, contents, tables, scene_set, visibility, truth_energy, stages):
    """Print the tables and write whatever files were asked for."""
    from hooc_perception.evaluation.tables import to_markdown, to_text
    from hooc_perception.io.scenes.files import write_atomically

    if not tables:
        raise HoocError(f'{args.set}: no scene has true poses or instance labels; there is '
                        'nothing to score against')
    print('\n\n'.join(to_text(table) for table in tables))
    if args.markdown:
        full = _visibility_tables(visibility)
        full = [*(table for table in tables if table not in full), *full]
        write_atomically(args.markdown, '\n'.join(to_markdown(table) for table in full))
    if args.json:
        from hooc_perception.evaluation.as_json import as_json
        content = as_json(scene_set, evaluations, visibility, truth_energy, stages)
        write_atomically(args.json, json.dumps(content, indent=1, allow_nan=False) + '\n')
    if args.plots:
        from hooc_perception.evaluation.plots import write_plots
        names = scene_set.category_names
        write_plots(args.plots, [(e.label, e.scores, e.per_category(names))
                                 for e in evaluations if e.scores], names,
                    [e for e in evaluations if e.scores])
    if args.bop_csv:
        from hooc_perception.evaluation.bop_csv import write_bop_csv
        write_bop_csv(args.bop_csv, contents[0], scene_set)


def _draw_worst(args, scene_set, evaluations, models, stages):
    """Draw the worst scenes of the first results and print why they are."""
    from hooc_perception.evaluation import worst
    from hooc_perception.evaluation.tables import to_text
    from hooc_perception.evaluation.worst_sheet import write_worst

    pools = (worst.read_pools(args.stages_from) if args.stages_from
             else worst.pools_of(stages))
    label = evaluations[0].label
    scenes = worst.worst_scenes(scene_set, evaluations[0], models, args.worst, pools)
    print('\n' + to_text(worst.worst_table(worst.worst_json(label, scenes))))
    write_worst(args.plots, label, scenes, models)

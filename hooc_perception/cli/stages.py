# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""`hooc stages`: what classifier, candidates and parsing lose."""

from argparse import ArgumentParser, Namespace

from hooc_perception.cli import options

HELP = ('Run the chain of a model on the annotated scenes of a set and show which stage loses '
        'the objects: pixels classified wrongly, objects without a candidate, candidates that '
        'parsing does not choose.')


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument('set', metavar='SET', help='scene set or BOP dataset with true poses')
    parser.add_argument('--model', metavar='MODEL', required=True,
                        help='model folder written by hooc train')
    options.add_scene(parser)
    parser.add_argument('--json', metavar='FILE',
                        help='write all figures as JSON, which hooc worst --stages reads')
    parser.add_argument('--markdown', metavar='FILE', help='write the tables as Markdown')
    options.add_executor(parser)


def run(args: Namespace) -> None:
    """Run the chain, print and write what its stages lose."""
    from hooc_perception.cli.categories import warn_of_gap
    from hooc_perception.cli.places import file_place
    from hooc_perception.cli.scoring import print_tables, require_poses, write_json
    from hooc_perception.evaluation import stage_tables
    from hooc_perception.evaluation.as_json import stages_as_json
    from hooc_perception.evaluation.rerun import rerun
    from hooc_perception.executor import executor, spread
    from hooc_perception.io.scenes.scene_set import load_scene_set
    from hooc_perception.trained.folder import load_model_folder

    file_place(args.json, '--json')
    file_place(args.markdown, '--markdown')
    folder = load_model_folder(args.model)
    scene_set = load_scene_set(args.set).selected(args.scene)
    require_poses(scene_set, 'stages')
    warn_of_gap([m.name for m in folder.models], scene_set.category_names, args.set)
    with executor(args.executor):
        losses = rerun(scene_set, folder, True, spread)[1]
    print_tables([stage_tables.stage_table(losses),
                  stage_tables.stage_category_table(losses, scene_set.category_names)],
                 args.markdown)
    write_json(args.json, stages_as_json(scene_set, losses))

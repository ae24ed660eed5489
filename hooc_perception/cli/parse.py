# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""`hooc parse`: the whole chain over a scene set in one process, no ROS."""

from itertools import repeat
import time

from hooc_perception.cli import executor_option
from hooc_perception.errors import HoocError

HELP = 'find the objects of a scene set, in one process without ROS'


def add_arguments(parser):
    """Declare the arguments."""
    parser.add_argument('set', help='folder of a scene set or BOP dataset')
    parser.add_argument('--model', required=True, help='model folder that hooc train wrote')
    parser.add_argument('--out', required=True, help='results file to write')
    parser.add_argument('--profile', choices=('paper', 'best', 'fast'),
                        help='default: the profile that the model was trained for')
    parser.add_argument('--scene', nargs='+', action='extend',
                        metavar='ID', help='only these scenes')
    parser.add_argument('--seed', type=int, help="default: the model's")
    parser.add_argument('--true-poses', action='store_true',
                        help='setting B: the true poses are among the candidates')
    parser.add_argument('--sigmas', action='store_true',
                        help='also estimate how far off each pose may be')
    parser.add_argument('--set-parameter', action='append', default=[], metavar='STAGE.NAME=VALUE',
                        help='change one parameter of the profile; may be repeated')
    executor_option.add_argument(parser)


def run(args):
    """Parse every scene and write the results."""
    from hooc_perception.cli.overrides import overrides_of
    from hooc_perception.core.pipeline import Pipeline
    from hooc_perception.core.profiles import profile, with_overrides
    from hooc_perception.executor import executor, spread
    from hooc_perception.models.folder import load_model_folder
    from hooc_perception.scenes.results import scene_result, write_results
    from hooc_perception.scenes.scene_set import load_scene_set
    from tqdm import tqdm

    scene_set, folder = load_scene_set(args.set), load_model_folder(args.model)
    names = [m.name for m in folder.models]
    chosen = with_overrides(profile(args.profile or folder.profile),
                            overrides_of(args.set_parameter))
    seed = folder.seed if args.seed is None else args.seed
    pipeline = Pipeline(folder.models, folder.classifier, chosen, seed, scene_set.max_instances,
                        args.sigmas)
    scenes = (scene_set.selected(args.scene) if args.scene else scene_set).scenes
    for scene in scenes if args.true_poses else ():
        if scene.truth is None:
            raise HoocError(f'scene {scene.name} has no ground_truth.yaml, which --true-poses '
                            'needs; leave the option out')
    results = []
    with executor(args.executor):
        # One scene at a time on the cores at hand, which the stages share out between them.
        done = spread(_parsed, repeat(pipeline), (scene.depth() for scene in scenes),
                      (scene.truth if args.true_poses else None for scene in scenes))
        for scene, (parsed, seconds) in zip(scenes, tqdm(
                done, total=len(scenes), desc='parsing', unit='scene', disable=None)):
            results.append(scene_result(
                scene.name, parsed, names, seconds, profile=chosen.name, seed=seed,
                setting='B' if args.true_poses else 'A', stage_seconds=parsed.seconds,
                **scene.world))
    write_results(args.out, scene_set.name, results, setting='B' if args.true_poses else 'A')
    print(f'{len(results)} scenes, {sum(len(r["objects"]) for r in results)} objects -> '
          f'{args.out}')


def _parsed(pipeline, views, truth):
    """Return (ParsedScene, seconds) of DepthViews; of setting B where `truth` is given."""
    from hooc_perception.evaluation.true_poses import with_true_poses
    change = None if truth is None else with_true_poses(truth, pipeline.models)
    start = time.monotonic()
    return pipeline.parse_scene(views, change), time.monotonic() - start

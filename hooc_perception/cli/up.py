# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""`hooc up`: the nodes alone, for live cameras."""

from argparse import ArgumentParser, Namespace
from pathlib import Path

from hooc_perception.chain import CHAIN, INGESTION
from hooc_perception.cli import options

HELP = ('Start the four nodes of the chain for live cameras and keep them running until '
        'interrupted. Cameras publish <camera>/depth/image_raw and camera_info under /hooc; '
        'results appear on /hooc/objects/poses and /hooc/objects/attributes.')


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the arguments of `hooc up`."""
    parser.add_argument('--cameras', type=Path, metavar='cameras.yaml',
                        help='names and poses of the cameras; without it, names come from the '
                             'model and poses from <camera>/extrinsics or /tf_static')
    options.add_chain(parser)
    parser.add_argument('--namespace', default='/hooc', help='default: %(default)s')
    parser.add_argument('--params', type=Path, metavar='FILE',
                        help='YAML file of node parameters, such as config/perception.yaml')
    parser.add_argument('--quiet', action='store_true', help='show only warnings and errors')


def run(args: Namespace) -> None:
    """Run the command until it is interrupted."""
    from hooc_perception.cli.run import chain_parameters, model_defaults
    from hooc_perception.supervisor.supervisor import Supervisor
    from hooc_perception.supervisor.watchdog import Watchdog
    from hooc_perception.trained.folder import load_model_folder
    model = load_model_folder(args.model)
    parameters = chain_parameters(args, model)
    if args.cameras:
        poses = camera_poses(args.cameras)
        for name in CHAIN:
            parameters[name]['cameras'] = tuple(poses)
        parameters[INGESTION].update(
            {f'extrinsics.{name}': pose for name, pose in poses.items()})
    up = False
    try:
        with Supervisor(CHAIN, parameters, args.namespace, verbose=not args.quiet,
                        params_file=args.params,
                        defaults=model_defaults(model)) as supervisor:
            watchdog = Watchdog(supervisor)
            supervisor.bring_up()
            up = True
            topic = supervisor.node.resolve_topic_name('objects/poses')
            print(f'the nodes are up; results appear on {topic}; stop with Ctrl-C', flush=True)
            while True:
                watchdog.spin(0.2)
    except KeyboardInterrupt:
        # The normal end of this command, unless the nodes were not up yet.
        if not up:
            raise


def camera_poses(path: str | Path) -> dict[str, list[float]]:
    """Return {camera: [x, y, z, qx, qy, qz, qw]} of a cameras.yaml."""
    from hooc_perception.core.geometry import pose_from_matrix
    from hooc_perception.io.scenes.camera_files import load_cameras
    poses = {}
    for name, camera in load_cameras(path).items():
        translation, rotation = pose_from_matrix(camera.T_world_camera)
        poses[name] = [*translation.tolist(), *rotation.tolist()]
    return poses

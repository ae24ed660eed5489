# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""`hooc replay`: a bag as live cameras."""

from argparse import ArgumentParser, Namespace
from pathlib import Path
import sys
from typing import Any

from hooc_perception.chain import REPLAY
from hooc_perception.errors import HoocError

HELP = ('Play a bag as live cameras under /hooc: wait until every camera has a subscriber, then '
        'publish the recorded images at their original pace with current stamps.')


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the arguments of `hooc replay`."""
    parser.add_argument('bag', type=Path, metavar='BAG',
                        help='rosbag2 folder, or .mcap, .db3 or (ROS 1) .bag file')
    parser.add_argument('--rate', type=float, default=1.0, metavar='R',
                        help='speed relative to the recording; 0 = as fast as the chain answers '
                        '(default: %(default)g)')
    parser.add_argument('--loop', action='store_true',
                        help='start again at the end, one frame period after the last image')
    parser.add_argument('--wait', type=float, default=30.0, metavar='S',
                        help='give up if no subscriber appears within S seconds (default: '
                        '%(default)g)')
    parser.add_argument('--namespace', default='/hooc', help='default: %(default)s')


def run(args: Namespace) -> None:
    """Play the bag until it has ended, or for ever with --loop."""
    import json

    from hooc_perception.io.bags.reader import BagScene
    from hooc_perception.ros.qos import qos
    from hooc_perception.supervisor.supervisor import Supervisor
    from std_msgs.msg import String
    if not 0 <= args.rate <= 100 or not args.wait > 0:
        raise HoocError('--rate must be from 0 to 100 and --wait positive')
    bag = BagScene(args.bag)
    for warning in bag.warnings:
        print(f'warning: {warning}', file=sys.stderr)
    parameters = {REPLAY: {'bag': str(args.bag.resolve()), 'rate': args.rate, 'loop': args.loop,
                           'match_timeout_s': args.wait}}
    with Supervisor((REPLAY,), parameters, args.namespace) as supervisor:
        status: dict[str, Any] = {}

        def on_status(message: String) -> None:
            status.update(json.loads(message.data))

        supervisor.node.create_subscription(String, 'replay/status', on_status,
                                            qos('replay/status'))
        supervisor.bring_up()
        print(f'playing {bag.name}: cameras {", ".join(c.name for c in bag.cameras)}', flush=True)
        while status.get('state') not in ('finished', 'failed'):
            supervisor.spin(0.2)
        if status['state'] == 'failed':
            supervisor.wait_a_moment()
            raise HoocError(supervisor.processes[REPLAY].last_words())
        # Subscribers that have not received the last images yet still can.
        supervisor.wait_a_moment(1.0)
    print(f'{status["images"]} images sent')

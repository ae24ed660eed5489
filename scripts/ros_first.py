# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Let this virtual environment's ROS win over a sourced one, at every start of its Python.

`scripts/setup.sh` copies this file into site-packages as `hooc_ros_first.py` and loads it with a
`.pth` line. The wheels' own bootstrapper starts Python once more with LD_LIBRARY_PATH, but in
random order, so that a sourced ROS could slip its libraries under the wheels' Python modules.
Here the environment's libraries come first and everything that the user had comes after; a
folder of PYTHONPATH that holds another rclpy is searched last instead of first.
"""

import glob
import os
import sys

GUARD = '_ROS_WHEELS_BOOTSTRAP_COMPLETE'     # the bootstrapper's own: it then has nothing to do


def order_libraries() -> None:
    """Start Python again with this environment's libraries first, unless they already are."""
    site = os.path.dirname(os.path.abspath(__file__))
    own = [os.path.join(sys.prefix, 'lib'),
           *sorted(glob.glob(os.path.join(glob.escape(site), 'ros_*.libs')))]
    old = [path for path in os.environ.get('LD_LIBRARY_PATH', '').split(os.pathsep) if path]
    new = own + [path for path in old if path not in own]
    if os.environ.get(GUARD) and old == new:
        return
    os.environ[GUARD] = '1'
    os.environ['LD_LIBRARY_PATH'] = os.pathsep.join(new)
    os.execv(sys.executable, sys.orig_argv)


def order_modules() -> None:
    """Move the entries of PYTHONPATH that hold a second rclpy to the end of sys.path."""
    named = [os.path.abspath(path) for path in os.environ.get('PYTHONPATH', '').split(os.pathsep)
             if path]
    late = [path for path in sys.path
            if path in named and os.path.isdir(os.path.join(path, 'rclpy'))]
    sys.path[:] = [path for path in sys.path if path not in late] + late


order_libraries()
order_modules()

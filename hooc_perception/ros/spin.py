# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Run one node in one process: single-threaded, ends quietly on signals and orphanhood."""

import ctypes
import os
import signal
import sys
import threading
import time

from hooc_perception.errors import HoocError
import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions

PARENT_VARIABLE = 'HOOC_SUPERVISOR_PID'
HEED_S = 0.2    # Python heeds a signal when it is through with waiting
_ENDS = signal.SIGINT, signal.SIGTERM
_PR_SET_PDEATHSIG = 1


def run_node(make_node, args=None):
    """
    Spin the node that `make_node()` returns until a signal; return the exit code.

    An active node is deactivated before it ends, while others still hear it.

    :param args: the ROS arguments, None = those of the process.
    """
    end_with_parent()
    # rclpy's own handlers would end the context first, in which nobody can say good-bye.
    for number in _ENDS:
        signal.signal(number, signal.default_int_handler)
    rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    node = None
    try:
        node = make_node()
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        while rclpy.ok():
            executor.spin_once(timeout_sec=HEED_S)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except HoocError as error:
        print(f'[ERROR] {error}', file=sys.stderr, flush=True)
        return 1
    finally:
        for number in _ENDS:
            signal.signal(number, signal.SIG_IGN)   # it ends already
        if node is not None:
            if rclpy.ok():
                node.leave()
            node.destroy_node()
        rclpy.try_shutdown()
    return 0


def end_with_parent():
    """
    End this process when the supervisor that started it ends, however it ends.

    Linux delivers SIGTERM by itself; the thread covers other systems and a process that does
    not heed SIGTERM because it is deep in a long computation.
    """
    parent = int(os.environ.get(PARENT_VARIABLE, 0))
    if not parent:
        return
    if sys.platform == 'linux':
        ctypes.CDLL(None, use_errno=True).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
    if os.getppid() != parent:
        # It died before we asked to be told.
        sys.exit(1)
    threading.Thread(target=_watch, args=(parent,), daemon=True).start()


def _watch(parent, grace_s=5.0):
    """Wait for another process to become our parent, ask ourselves to end, then insist."""
    while os.getppid() == parent:
        time.sleep(0.5)
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(grace_s)
    os._exit(1)

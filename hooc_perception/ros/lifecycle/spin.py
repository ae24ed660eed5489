# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Run one node in one process: single-threaded, ends quietly on signals and orphanhood."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
import ctypes
import os
import signal
import sys
import threading
import time
from types import FrameType
from typing import Any, TYPE_CHECKING

from hooc_perception.errors import HoocError
import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import ok, try_shutdown

if TYPE_CHECKING:
    from hooc_perception.ros.lifecycle.stage_node import StageNode

PARENT_VARIABLE = 'HOOC_SUPERVISOR_PID'
# Destroying a node takes less than a second.
END_GRACE_S = 10
# Ctrl-C reaches a process twice under ros2 launch: from the terminal and from launch.
AGAIN_S = 1.0
HEED_S = 0.2    # Python handles a signal only between two waits
_PR_SET_PDEATHSIG = 1


def run_node(make_node: 'Callable[[], StageNode[Any, Any]]',
             args: Sequence[str] | None = None) -> int:
    """
    Spin the StageNode that `make_node()` returns until a signal; return the exit code.

    An active node is deactivated before it ends, while others still receive its messages.

    :param args: the ROS arguments, None = those of the process.
    """
    try:
        interrupt = _Interrupt()
        with suppress(ValueError):      # not in the main thread: signals are not ours
            for number in (signal.SIGINT, signal.SIGTERM):
                signal.signal(number, interrupt)
        end_with_parent()
        return _run(make_node, args, interrupt)
    except KeyboardInterrupt:
        return 0


def raise_interrupt(error: BaseException) -> None:
    """Raise the KeyboardInterrupt that compiled code has turned into another error, if it has."""
    if isinstance(error.__cause__, KeyboardInterrupt):
        raise error.__cause__


class _Interrupt:
    """
    Raise KeyboardInterrupt for the first signal; later ones do not disturb the shutdown.

    Compiled code that calls back into Python (llvmlite, while it compiles) ignores exceptions.
    The next signal then raises again, and `heard` ends the loop.

    :ivar heard: whether a signal has come.
    :ivar leaving: set when the shutdown has begun.
    """

    def __init__(self) -> None:
        self.heard = self.leaving = False
        self._first = 0.0       # time.monotonic()

    def __call__(self, number: int, frame: FrameType | None) -> None:
        again = self.heard and time.monotonic() - self._first < AGAIN_S
        if not self.leaving and not again:
            self._first = self._first if self.heard else time.monotonic()
            self.heard = True
            raise KeyboardInterrupt


def _run(make_node: 'Callable[[], StageNode[Any, Any]]', args: Sequence[str] | None,
         interrupt: '_Interrupt') -> int:
    # rclpy's own handlers would shut the context down first, and the node could not leave.
    rclpy.init(args=None if args is None else list(args),
               signal_handler_options=SignalHandlerOptions.NO)
    node = None
    try:
        node = make_node()
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        while ok() and not interrupt.heard:
            executor.spin_once(timeout_sec=HEED_S)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except rclpy_implementation.RCLError:
        # The context may be shut down at any moment, also between two calls that need it.
        if ok():
            raise
    except HoocError as error:
        print(f'[ERROR] {error}', file=sys.stderr, flush=True)
        return 1
    finally:
        interrupt.leaving = True
        if node is not None and ok():
            node.leave()
        with _no_longer_than(END_GRACE_S):
            if node is not None:
                node.destroy_node()
            try_shutdown()
    return 0


@contextmanager
def _no_longer_than(seconds: int) -> Iterator[None]:
    """
    Have the kernel end this process if the block takes longer.

    Fast DDS can deadlock with its own discovery while a participant is destroyed, with the
    interpreter lock held: no thread of ours could act.
    """
    alarm = getattr(signal, 'alarm', lambda _: None)    # Windows has none
    alarm(seconds)
    try:
        yield
    finally:
        alarm(0)


def end_with_parent() -> None:
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


def _watch(parent: int, grace_s: float = 5.0) -> None:
    """Wait until another process becomes our parent, then end: politely first, then at once."""
    while os.getppid() == parent:
        time.sleep(0.5)
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(grace_s)
    os._exit(1)

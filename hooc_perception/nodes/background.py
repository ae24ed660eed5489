# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
A computation beside the work of a node, which can be given up at any moment.

It runs in a process of its own. A thread cannot be ended, so that it would go on beside the frame
set that has made it useless; and kernels of two threads must not run at once in every threading
layer of numba. Run as a module, this file is that process.
"""

from collections.abc import Callable
from contextlib import suppress
import os
import pickle
import subprocess
import sys
import threading
import time
import traceback
from typing import BinaryIO, cast, Generic, TypeVar

from hooc_perception.errors import HoocError

T = TypeVar('T')
# The nodes come first where processors are scarce.
NICE = 10


class Background(Generic[T]):
    """
    One call of a function in another process, from now on.

    :param work: can be pickled, and so can what it returns; defined in an importable module.
    :raises OSError: if no process can be started.
    """

    def __init__(self, work: Callable[[], T]) -> None:
        paths = os.pathsep.join(filter(None, sys.path))
        # A session of its own: Ctrl-C reaches the node only, which gives the work up.
        self._process = subprocess.Popen(
            [sys.executable, '-m', 'hooc_perception.nodes.background', str(os.getpid())],
            env={**os.environ, 'PYTHONPATH': paths}, stdin=subprocess.PIPE,
            stdout=subprocess.PIPE, start_new_session=True)
        self._value: T | None = None
        self._failure: str | None = None
        self._thread = threading.Thread(target=self._wait, args=(work,), daemon=True)
        self._thread.start()

    @property
    def is_done(self) -> bool:
        """Return whether `result` has something to say."""
        return not self._thread.is_alive()

    def result(self) -> T:
        """
        Return what the function has returned, once it is done.

        :raises HoocError: if it has failed, with the reason.
        """
        if self._failure is not None:
            raise HoocError(self._failure)
        return cast(T, self._value)

    def discard(self) -> None:
        """End the process at once, and do not wait for it."""
        self._process.kill()

    def _wait(self, work: Callable[[], T]) -> None:
        """Pass the work on and wait for its end, in a thread."""
        with self._process as process:
            try:
                self._value, self._failure = _exchanged(process, work)
            except Exception as error:
                self._failure = _sentence(error)
            finally:
                process.kill()


def _exchanged(process: 'subprocess.Popen[bytes]', work: Callable[[], T],
               ) -> tuple[T | None, str | None]:
    """Return what `serve` answers in another process, or how that ended."""
    assert process.stdin is not None and process.stdout is not None
    # It may end while it reads, and then there is no reply.
    with suppress(BrokenPipeError), process.stdin as job:
        pickle.dump(work, job, pickle.HIGHEST_PROTOCOL)
    if reply := process.stdout.read():
        return pickle.loads(reply)
    code = process.wait()
    return None, f'its process has ended early (exit code {code})' + (
        '; was there too little memory?' if code == -9 else '')


def serve(job: BinaryIO, reply: BinaryIO) -> None:
    """Call the function that is pickled in `job`; pickle (value, None) or (None, reason)."""
    try:
        answer = pickle.dumps((pickle.load(job)(), None), pickle.HIGHEST_PROTOCOL)
    except Exception as error:
        if not isinstance(error, (HoocError, EOFError)):
            traceback.print_exc()
        answer = pickle.dumps((None, _sentence(error)))
    with suppress(BrokenPipeError):     # the node has ended meanwhile
        reply.write(answer)
        reply.flush()


def _sentence(error: Exception) -> str:
    return str(error) if isinstance(error, HoocError) else (
        f'unexpected {type(error).__name__}: {error}')


def _end_with(parent: int) -> None:
    """Wait until another process becomes the parent, then end this one."""
    while os.getppid() == parent:
        time.sleep(0.5)
    os._exit(1)


if __name__ == '__main__':
    threading.Thread(target=_end_with, args=(int(sys.argv[1]),), daemon=True).start()
    if hasattr(os, 'nice'):     # Windows has none
        os.nice(NICE)
    # What libraries print must not get into the reply.
    to_node = os.fdopen(os.dup(1), 'wb')
    os.dup2(2, 1)
    serve(sys.stdin.buffer, to_node)

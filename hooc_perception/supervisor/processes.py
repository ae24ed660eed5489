# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""A node as a process: start it, forward its output, detect its end, end it."""

from collections import deque
from collections.abc import Mapping
from pathlib import Path
import re
import signal
import subprocess
import sys
import threading
import time
from typing import Any

from hooc_perception.supervisor.environment import child_environment
from hooc_perception.supervisor.params_file import open_last_file

_QUIET, _LOUD = ('[INFO]', '[DEBUG]'), ('[WARN]', '[ERROR]', '[FATAL]')


class NodeProcess:
    """
    One node in a process and process group of its own.

    :ivar name: of the node and of its module in hooc_perception.nodes.
    """

    def __init__(self, name: str, parameters: Mapping[str, Any], namespace: str,
                 params_file: Path | None = None, verbose: bool = False,
                 module: str | None = None, defaults: Mapping[str, Any] | None = None) -> None:
        """
        Start the process.

        :param parameters: {name: value}; empty lists and None are left at their defaults.
        :param params_file: YAML of the user; `parameters` take precedence.
        :param verbose: forward all output, not only warnings and errors.
        :param module: another module to run, in tests.
        :param defaults: {name: value} for what neither `parameters` nor the file set.
        """
        self.name, self._verbose = name, verbose
        self._lines: deque[str] = deque(maxlen=40)
        self._stopping = False
        node = f'{namespace.rstrip("/")}/{name}'
        # A group of its own: Ctrl-C only reaches the supervisor, which ends the nodes in order.
        with open_last_file(parameters, node, params_file, defaults) as last:
            paths = [*([params_file] if params_file else []), f'/dev/fd/{last.fileno()}']
            self._process = subprocess.Popen(
                [sys.executable, '-m', module or f'hooc_perception.nodes.{name}', '--ros-args',
                 '-r', f'__ns:={namespace}',
                 # The log comes through the pipe; log files are not needed.
                 '--disable-external-lib-logs',
                 *(word for path in paths for word in ('--params-file', str(path)))],
                env=child_environment(), stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT, text=True, errors='replace', start_new_session=True,
                pass_fds=[last.fileno()])
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    @property
    def pid(self) -> int:
        """Return the process id."""
        return self._process.pid

    def exit_code(self) -> int | None:
        """Return the exit code, None while it runs."""
        return self._process.poll()

    def manner_of_death(self) -> str:
        """Return in words how the process ended."""
        code = self.exit_code()
        if code is None:
            return 'still running'
        if code >= 0:
            return f'exit code {code}'
        try:
            name = signal.Signals(-code).name
        except ValueError:
            name = f'signal {-code}'
        return f'killed by {name}' + (
            '; possibly out of memory' if -code == signal.SIGKILL else '')

    def last_words(self) -> str:
        """Return the last error that it printed, or else its last line."""
        self._reader.join(0.5 if self.exit_code() is not None else 0)
        lines = [line for line in self._lines if line]
        errors = [line for line in lines if line.startswith(('[ERROR]', '[FATAL]'))]
        return re.sub(r'^\[(ERROR|FATAL)\] ', '', (errors or lines or ['it printed nothing'])[-1])

    def ask_to_stop(self) -> None:
        """
        Send SIGTERM, on which `run_node` shuts down in order.

        Not SIGINT: a process that is still importing would print a traceback.
        """
        self._stopping = True
        self._signal(signal.SIGTERM)

    def kill(self) -> None:
        """End it at once; the watchdog notices."""
        self._signal(signal.SIGKILL)

    def stop(self, deadline: float) -> None:
        """
        Wait for the end of the process, and kill it after a deadline.

        :param deadline: time.monotonic().
        """
        try:
            self._process.wait(max(0.0, deadline - time.monotonic()))
        except subprocess.TimeoutExpired:
            self._signal(signal.SIGKILL)
            self._process.wait(5)
        self._reader.join(1)

    def _signal(self, number: signal.Signals) -> None:
        if self._process.poll() is None:
            self._process.send_signal(number)

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            line = line.rstrip()
            self._lines.append(line)
            # Unformatted lines during shutdown are complaints of libraries about gone objects.
            if self._stopping and not line.startswith((*_QUIET, *_LOUD)):
                continue
            if line and (self._verbose or not line.startswith(_QUIET)):
                print(f'[{self.name}] {line}', file=sys.stderr, flush=True)
        self._process.stdout.close()

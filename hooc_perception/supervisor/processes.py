# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""A node as a process: start it, pass on what it says, notice its end, end it."""

from collections import deque
import re
import signal
import subprocess
import sys
import threading
import time

from hooc_perception.supervisor.environment import child_environment
from hooc_perception.supervisor.params_file import open_last_file

_QUIET, _LOUD = ('[INFO]', '[DEBUG]'), ('[WARN]', '[ERROR]', '[FATAL]')


class NodeProcess:
    """
    One node in a process and a process group of its own.

    :ivar name: of the node, which is also that of its module in hooc_perception.nodes.
    """

    def __init__(self, name, parameters, namespace, params_file=None,
                 verbose=False, module=None, defaults=None):
        """
        Start the process.

        :param parameters: {name: value}; empty lists and None are left at their defaults.
        :param params_file: YAML of the user; `parameters` win over it.
        :param verbose: pass on everything; else only warnings and errors.
        :param module: another module to run, in tests.
        :param defaults: {name: value} that hold where neither the file nor `parameters` say
            otherwise.
        """
        self.name, self._verbose = name, verbose
        self._lines, self._stopping = deque(maxlen=40), False
        node = f'{namespace.rstrip("/")}/{name}'
        # A group of its own: Ctrl-C reaches the supervisor only, which ends the nodes in order.
        with open_last_file(parameters, node, params_file, defaults) as last:
            paths = [*([params_file] if params_file else []), f'/dev/fd/{last.fileno()}']
            self._process = subprocess.Popen(
                [sys.executable, '-m', module or f'hooc_perception.nodes.{name}', '--ros-args',
                 '-r', f'__ns:={namespace}',
                 # What they say comes through the pipe; no files in the home directory as well.
                 '--disable-external-lib-logs',
                 *(word for path in paths for word in ('--params-file', str(path)))],
                env=child_environment(), stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT, text=True, errors='replace', start_new_session=True,
                pass_fds=[last.fileno()])
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    @property
    def pid(self):
        """Return the process id."""
        return self._process.pid

    def exit_code(self):
        """Return the exit code, None while it runs."""
        return self._process.poll()

    def manner_of_death(self):
        """Return in words how a process that has ended did so."""
        code = self.exit_code()
        if code >= 0:
            return f'exit code {code}'
        try:
            name = signal.Signals(-code).name
        except ValueError:
            name = f'signal {-code}'
        return f'killed by {name}' + ('; was memory short?' if -code == signal.SIGKILL else '')

    def last_words(self):
        """Return the last error that it printed, or its last line."""
        self._reader.join(0.5 if self.exit_code() is not None else 0)
        lines = [line for line in self._lines if line]
        errors = [line for line in lines if line.startswith(('[ERROR]', '[FATAL]'))]
        return re.sub(r'^\[(ERROR|FATAL)\] ', '', (errors or lines or ['it said nothing'])[-1])

    def ask_to_stop(self):
        """
        Send SIGTERM, which `run_node` turns into an orderly end.

        Not SIGINT: a process that is still importing would print a trace.
        """
        self._stopping = True
        self._signal(signal.SIGTERM)

    def kill(self):
        """End it at once; the watchdog notices."""
        self._signal(signal.SIGKILL)

    def stop(self, deadline):
        """
        Make sure that it has ended.

        :param deadline: time.monotonic() until which it may take its time.
        """
        try:
            self._process.wait(max(0.0, deadline - time.monotonic()))
        except subprocess.TimeoutExpired:
            self._signal(signal.SIGKILL)
            self._process.wait(5)
        self._reader.join(1)

    def _signal(self, number):
        if self._process.poll() is None:
            self._process.send_signal(number)

    def _read(self):
        for line in self._process.stdout:
            line = line.rstrip()
            self._lines.append(line)
            # What it does not log at its end is what libraries say of what is gone already.
            if self._stopping and not line.startswith((*_QUIET, *_LOUD)):
                continue
            if line and (self._verbose or not line.startswith(_QUIET)):
                print(f'[{self.name}] {line}', file=sys.stderr, flush=True)
        self._process.stdout.close()

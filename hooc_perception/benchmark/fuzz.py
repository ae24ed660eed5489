# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Feed damaged bags, messages and models to everything that reads them.

Each case is generated from its number alone and runs in a process of its own that must not
crash, hang or exhaust the memory: the input is either read or rejected in one sentence.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
import importlib
import multiprocessing
from multiprocessing.connection import Connection
import os
from pathlib import Path
import resource
import tempfile
import time
from typing import TypeAlias

from hooc_perception.benchmark.fuzz_bags import bag_cases
from hooc_perception.benchmark.fuzz_models import model_cases
from hooc_perception.core.geometry import stage_rng
from hooc_perception.errors import HoocError
import numpy as np

READ, REJECTED = 'read', 'rejected'
# A case takes milliseconds, but the first one that parses compiles the kernels, which takes more
# than a minute on a slow machine. Longer than this is a hang.
HANG_S = 240.0
MEMORY_BYTES = 6 << 30
LONGEST_SENTENCE = 700
Case: TypeAlias = Callable[[np.random.Generator, Path], None]


@dataclass
class FuzzResult:
    """
    The outcomes of all cases.

    :ivar outcomes: (kind of case, 'read' or 'rejected') -> number.
    :ivar failures: [(case number, kind, what happened)]: crashes, hangs, exceptions other than
        HoocError, rejections that are not one sentence.
    """

    outcomes: Counter[tuple[str, str]] = field(default_factory=Counter)
    failures: list[tuple[int, str, str]] = field(default_factory=list)


OURS = 'hooc_perception.benchmark.fuzz:kinds_of_cases'


def fuzz(cases: int, seed: int = 0, progress: Callable[[range], Iterable[int]] = iter,
         source: str = OURS) -> FuzzResult:
    """
    Run cases 0..cases-1 of a seed; return the FuzzResult.

    :param progress: wraps the sequence of case numbers, as tqdm does.
    :param source: `module:function` that returns {kind: function(rng, folder)}.
    """
    result, worker = FuzzResult(), None
    try:
        for number in progress(range(cases)):
            worker = worker or _Worker(seed, source)
            kind, outcome, text = worker.run(number)
            if outcome in (READ, REJECTED):
                result.outcomes[kind, outcome] += 1
            else:
                result.failures.append((number, kind, text))
            if not worker.alive():
                worker.close()
                worker = None
    finally:
        if worker:
            worker.close()
    return result


def run_case(number: int, seed: int, kinds: Mapping[str, Case],
             folder: str | Path) -> tuple[str, str, str]:
    """Return (kind, outcome, text) of one case; `kinds` maps names to functions."""
    rng = stage_rng(seed, 'fuzz', number)
    kind = sorted(kinds)[number % len(kinds)]
    try:
        kinds[kind](rng, Path(folder))
        return kind, READ, ''
    except HoocError as error:
        text = str(error)
        if not text.strip() or '\n' in text or len(text) > LONGEST_SENTENCE:
            return kind, 'bad sentence', f'not one sentence: {text[:300]!r}'
        return kind, REJECTED, text
    except MemoryError:
        return kind, 'memory', f'more than {MEMORY_BYTES} bytes were requested'
    except Exception as error:
        import traceback
        where = traceback.extract_tb(error.__traceback__)[-1]
        return kind, 'exception', (f'{type(error).__name__}: {error} in {where.filename}:'
                                   f'{where.lineno}')


def kinds_of_cases() -> dict[str, Case]:
    """Return {name: function(rng, folder)} of all kinds of cases that can run here."""
    kinds = {**bag_cases(), **model_cases()}
    try:
        from hooc_perception.benchmark.fuzz_messages import message_cases
        kinds.update(message_cases())
    except ImportError:     # without ROS
        pass
    return kinds


class _Worker:
    """A process that runs cases one by one."""

    def __init__(self, seed: int, source: str) -> None:
        context = multiprocessing.get_context('spawn')
        self._folder = tempfile.TemporaryDirectory(prefix='hooc_fuzz_')
        self._here, there = context.Pipe()
        self._process = context.Process(
            target=_serve, args=(there, seed, source, self._folder.name), daemon=True)
        self._process.start()
        there.close()
        self._here.recv()       # it is ready

    def run(self, number: int) -> tuple[str, str, str]:
        """Return (kind, outcome, text) of a case; a dead worker is an outcome as well."""
        self._here.send(number)
        deadline = time.monotonic() + HANG_S
        while time.monotonic() < deadline:
            try:
                if self._here.poll(0.5):
                    return self._here.recv()
            except EOFError:
                self._process.join(5)
                return '?', 'crash', f'the process died (exit code {self._process.exitcode})'
        self._process.kill()
        self._process.join(5)
        return '?', 'hang', f'not finished after {HANG_S:g} s'

    def alive(self) -> bool:
        """Return whether the process can run another case."""
        return self._process.is_alive()

    def close(self) -> None:
        """End the process and remove its files."""
        self._process.kill()
        self._process.join(5)
        self._folder.cleanup()


def _serve(connection: Connection, seed: int, source: str, folder: str) -> None:
    """Run the cases whose numbers come through the pipe."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
    with open(os.devnull, 'w') as nothing:      # C libraries print errors of their own
        os.dup2(nothing.fileno(), 2)
    module, _, name = source.partition(':')
    kinds = getattr(importlib.import_module(module), name)()
    connection.send('ready')
    while True:
        connection.send(run_case(connection.recv(), seed, kinds, folder))

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Run the steps that are out of date, one after another, and record what each took."""

from collections.abc import Callable, Sequence
from dataclasses import asdict
import hashlib
import json
import os
from pathlib import Path
import subprocess
import sys
import time

from hooc_perception.errors import HoocError
from hooc_perception.experiments import fingerprint
from hooc_perception.experiments.plan import CODE, Step
from hooc_perception.experiments.records import load_records, Record, RECORDS
from hooc_perception.io.scenes.files import write_atomically


def key_of(step: Step) -> str:
    """Return the fingerprint of a step's command and of the contents of its inputs."""
    digest = hashlib.sha256()
    for before, argument in zip(('', *step.arguments), step.arguments):
        # Where a file lies does not matter, nor does the number of workers.
        if before != '--jobs':
            text = 'path' if isinstance(argument, Path) else argument
            digest.update(text.encode() + b'\0')
    for path in step.inputs:
        digest.update(fingerprint.of_path(path).encode())
    return digest.hexdigest()[:16]


def reason_to_run(step: Step, record: Record | None, keep: Sequence[str] = (),
                  force: Sequence[str] = ()) -> str:
    """
    Return why a step has to run, '' where it need not.

    :param record: Record of the last time, None where there was none.
    :param keep: rows that stay as they are even though the code has changed.
    :param force: rows that run in any case.
    """
    if record is None or not step.output.exists():
        return 'not done yet'
    if step.row in force:
        return 'forced'
    if record.key != key_of(step):
        return 'its inputs have changed'
    if record.code != fingerprint.of_code(CODE[step.kind]) and step.row not in keep:
        return 'its code has changed'
    return ''


def run(steps: Sequence[Step], root: str | Path, keep: Sequence[str] = (),
        force: Sequence[str] = (), dry: bool = False,
        say: Callable[[str], object] = print) -> dict[str, Record]:
    """
    Run what is out of date; return {step name: Record}.

    :param dry: only say what would run and why.
    :raises HoocError: where a step fails, with its log's path; the next call resumes there.
    """
    root, start, done = Path(root), time.monotonic(), 0
    pending: set[Path] = set()
    records = load_records(root)
    for number, step in enumerate(steps, 1):
        why = ('depends on another' if pending & set(step.inputs)
               else reason_to_run(step, records.get(step.name), keep, force))
        head = f'[{number}/{len(steps)}] {step.name}'
        if not why:
            say(f'{head}: up to date')
            continue
        say(f'{head}: {why}')
        if dry:
            pending.add(step.output)
            continue
        records[step.name] = record = execute(step, root)
        done += 1
        write_atomically(root / RECORDS, json.dumps(
            {name: asdict(r) for name, r in records.items()}, indent=1) + '\n')
        say(f'{head}: {record.cpu_s:.0f} s of processor time, {record.wall_s:.0f} s, '
            f'{record.peak_mb:.0f} MB')
    say(f'{done} steps in {time.monotonic() - start:.0f} s')
    return records


def execute(step: Step, root: Path) -> Record:
    """Run one step as a process of its own; return its Record."""
    key, code = key_of(step), fingerprint.of_code(CODE[step.kind])
    commit = fingerprint.commit()
    log = Path(root) / 'logs' / (step.name.replace('/', '_') + '.log')
    for path in (log, step.output):
        path.parent.mkdir(parents=True, exist_ok=True)
    command = [sys.executable, '-m', 'hooc_perception.cli.main', *map(str, step.arguments)]
    start = time.monotonic()
    with log.open('w') as file:
        # On a terminal the progress bars of the step are shown.
        process = subprocess.Popen(command, stdout=file, stdin=subprocess.DEVNULL,
                                   stderr=None if sys.stderr.isatty() else file)
        try:
            # wait4 reports the resources of this process and of the workers it waited for.
            _, status, used = os.wait4(process.pid, 0)
        except BaseException:
            process.terminate()
            process.wait()
            raise
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode or not step.output.exists():
        raise HoocError(f'{step.name} failed; {log} says why; fix that and run the same command '
                        'again, finished steps are kept')
    return Record(key, code, commit, round(used.ru_utime + used.ru_stime, 1),
                  round(time.monotonic() - start, 1), round(used.ru_maxrss / 1024, 0))

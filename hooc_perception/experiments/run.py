# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Run the steps that are out of date, one after another, and record what each took."""

from dataclasses import asdict, dataclass
import hashlib
import json
import os
from pathlib import Path
import subprocess
import sys
import time

from hooc_perception.errors import HoocError
from hooc_perception.experiments import fingerprint
from hooc_perception.experiments.plan import CODE
from hooc_perception.io.scenes.files import write_atomically

RECORDS = 'steps.json'


@dataclass(frozen=True)
class Record:
    """
    How a step went.

    :ivar key: fingerprint of its command and inputs; `code` of the code that ran.
    :ivar commit: of the source tree then, + where files were changed.
    :ivar cpu_s: processor seconds of the process and its children; `wall_s` seconds passed.
    :ivar peak_mb: most memory of the process.
    """

    key: str
    code: str
    commit: str
    cpu_s: float
    wall_s: float
    peak_mb: float


def load_records(root):
    """Return {step name: Record} of what was run before."""
    path = Path(root) / RECORDS
    if not path.exists():
        return {}
    try:
        return {name: Record(**entry) for name, entry in json.loads(path.read_text()).items()}
    except (ValueError, TypeError) as e:
        raise HoocError(f'{path} is damaged ({e}); delete it to run every step again') from None


def key_of(step):
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


def reason_to_run(step, record, keep=(), force=()):
    """
    Return why a step has to run, '' where it has not.

    :param record: Record of the last time, None where there was none.
    :param keep: rows that stay as they are though the code has changed.
    :param force: rows that run in any case.
    """
    if record is None or not step.output.exists():
        return 'not done yet'
    if step.row in force:
        return 'asked for'
    if record.key != key_of(step):
        return 'its inputs have changed'
    if record.code != fingerprint.of_code(CODE[step.kind]) and step.row not in keep:
        return 'its code has changed'
    return ''


def run(steps, root, keep=(), force=(), dry=False, say=print):
    """
    Run what is out of date; return {step name: Record}.

    :param dry: only say what would run and why.
    :raises HoocError: where a step fails, with its log's path; the next call resumes there.
    """
    root, start, done, pending = Path(root), time.monotonic(), 0, set()
    records = load_records(root)
    for number, step in enumerate(steps, 1):
        why = ('follows another' if pending & set(step.inputs)
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


def execute(step, root):
    """Run one step as a process of its own; return its Record."""
    key, code = key_of(step), fingerprint.of_code(CODE[step.kind])
    commit = fingerprint.commit()
    log = Path(root) / 'logs' / (step.name.replace('/', '_') + '.log')
    for path in (log, step.output):
        path.parent.mkdir(parents=True, exist_ok=True)
    command = [sys.executable, '-m', 'hooc_perception.cli.main', *map(str, step.arguments)]
    start = time.monotonic()
    with log.open('w') as file:
        # On a terminal the step's own progress bars show.
        process = subprocess.Popen(command, stdout=file, stdin=subprocess.DEVNULL,
                                   stderr=None if sys.stderr.isatty() else file)
        try:
            # wait4 tells what this process and the workers that it waited for have used.
            _, status, used = os.wait4(process.pid, 0)
        except BaseException:
            process.terminate()
            process.wait()
            raise
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode or not step.output.exists():
        raise HoocError(f'{step.name} failed; {log} says why. Mend that and run the same '
                        'command again: what is done is kept')
    return Record(key, code, commit, round(used.ru_utime + used.ru_stime, 1),
                  round(time.monotonic() - start, 1), round(used.ru_maxrss / 1024, 0))

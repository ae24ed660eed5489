# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Resolve requirements.in into requirements.txt for every Python that we serve.

    python scripts/lock.py python3.11 python3.12

Each interpreter resolves by itself (pip's own resolver, nothing is installed). Rows that the
interpreters do not share get an environment marker. What is pinned today stays pinned as long as
requirements.in allows it; delete requirements.txt first to upgrade everything.
"""

import json
from pathlib import Path
import subprocess
import sys
import tempfile

ROOT = Path(__file__).resolve().parent.parent
HEADER = """\
# Written by scripts/lock.py from requirements.in: do not edit by hand.
# Complete: `pip install --no-deps -r requirements.txt` gives the same environment anywhere.
"""

# pyrender asks for PyOpenGL 3.1.0, which cannot use OSMesa and has no wheel; it works with this.
OVERRIDES = {'pyopengl': '3.1.10'}


def resolve(python, constraints):
    """Return ('3.x', {name: version}) as pip resolves requirements.in under `python`."""
    version = subprocess.run(
        [python, '-c', 'import sys; print("%d.%d" % sys.version_info[:2])'],
        check=True, capture_output=True, text=True).stdout.strip()
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / 'report.json'
        command = [python, '-m', 'pip', 'install', '-q', '--dry-run', '--ignore-installed',
                   '--report', str(report),
                   '-r', str(ROOT / 'requirements.in'), '-c', str(constraints)]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        rows = json.loads(report.read_text())['install']
    return version, {row['metadata']['name'].lower().replace('_', '-'): row['metadata']['version']
                     for row in rows}


def main(pythons):
    """Write requirements.txt for the interpreters `pythons` (list of str)."""
    target = ROOT / 'requirements.txt'
    with tempfile.TemporaryDirectory() as folder:
        constraints = Path(folder) / 'constraints.txt'
        old = target.read_text().splitlines() if target.exists() else []
        constraints.write_text('\n'.join(
            line for line in old if line.split('==')[0] not in OVERRIDES))
        solved = dict(resolve(python, constraints) for python in pythons)
    for rows in solved.values():
        rows.update({name: pin for name, pin in OVERRIDES.items() if name in rows})
    lines = []
    for name in sorted(set().union(*solved.values())):
        pins = {version: rows.get(name) for version, rows in solved.items()}
        if len(set(pins.values())) == 1:
            lines.append(f'{name}=={pins[next(iter(pins))]}')
        else:
            lines += [f"{name}=={pin}; python_version == '{version}'"
                      for version, pin in pins.items() if pin]
    target.write_text(HEADER + '\n'.join(lines) + '\n')
    print(f'{target.name}: {len(lines)} packages for Python {", ".join(solved)}')


if __name__ == '__main__':
    main(sys.argv[1:] or [sys.executable])

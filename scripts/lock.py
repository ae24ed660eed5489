# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Resolve the dependencies of pyproject.toml, extras included, into requirements.txt.

    python scripts/lock.py python3.11 python3.12

Each interpreter resolves by itself (pip's own resolver, nothing is installed). Rows that the
interpreters do not share get an environment marker. What is pinned today stays pinned as long as
pyproject.toml allows it; delete requirements.txt first to upgrade everything.
"""

import json
from pathlib import Path
import re
import subprocess
import sys
import tempfile
import tomllib

ROOT = Path(__file__).resolve().parent.parent
HEADER = """\
# Written by scripts/lock.py from pyproject.toml: do not edit by hand.
# Complete: `pip install --no-deps -r requirements.txt` gives the same environment anywhere.
"""

# pyrender asks for PyOpenGL 3.1.0, which cannot use OSMesa and has no wheel; it works with this.
OVERRIDES = {'pyopengl': '3.1.10'}
# Large, and only for `hooc report --rerun` and for training the network over the table again.
NOT_LOCKED = {'rerun-sdk', 'torch', 'onnx'}
# yourdfpy asks for trimesh with everything that it can make use of (ray casting, servers,
# drawings). Reading a URDF needs none of it, and embreex has no wheel for aarch64.
NOT_NEEDED = {'anyio', 'colorlog', 'embreex', 'h11', 'httpcore', 'httpx', 'mapbox-earcut', 'rtree',
              'shapely', 'svg-path', 'vhacdx', 'xxhash'}


def normalized(name: str) -> str:
    """Return the name of a distribution as PyPI compares it."""
    return re.sub(r'[-_.]+', '-', name).lower()


def distribution(requirement: str) -> str:
    """Return the normalized name in a requirement such as `rosbags>=0.10`."""
    found = re.match(r'[A-Za-z0-9._-]+', requirement)
    assert found, requirement
    return normalized(found[0])


def wanted(pyproject: Path = ROOT / 'pyproject.toml') -> list[str]:
    """Return the requirements of the project and of all its extras, each once."""
    project = tomllib.loads(pyproject.read_text())['project']
    rows = [*project['dependencies'],
            *(row for extra in project['optional-dependencies'].values() for row in extra)]
    own = normalized(project['name'])      # an extra may name other extras of the project
    return [row for row in dict.fromkeys(rows) if distribution(row) not in {own, *NOT_LOCKED}]


def resolve(python: str, constraints: Path) -> tuple[str, dict[str, str]]:
    """Return ('3.x', {name: version}) as pip resolves the requirements under `python`."""
    version = subprocess.run(
        [python, '-c', 'import sys; print("%d.%d" % sys.version_info[:2])'],
        check=True, capture_output=True, text=True).stdout.strip()
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / 'report.json'
        requirements = Path(folder) / 'requirements.in'
        requirements.write_text('\n'.join(wanted()))
        command = [python, '-m', 'pip', 'install', '-q', '--dry-run', '--ignore-installed',
                   '--report', str(report), '-r', str(requirements), '-c', str(constraints)]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        rows = json.loads(report.read_text())['install']
    found = {normalized(row['metadata']['name']): row['metadata']['version'] for row in rows}
    return version, {name: pin for name, pin in found.items() if name not in NOT_NEEDED}


def main(pythons: list[str]) -> None:
    """Write requirements.txt for the interpreters `pythons`."""
    target = ROOT / 'requirements.txt'
    with tempfile.TemporaryDirectory() as folder:
        constraints = Path(folder) / 'constraints.txt'
        old = target.read_text().splitlines() if target.exists() else []
        constraints.write_text('\n'.join(
            line for line in old if line.split('==')[0] not in OVERRIDES))
        solved = dict(resolve(python, constraints) for python in pythons)
    for rows in solved.values():
        rows.update({name: pin for name, pin in OVERRIDES.items() if name in rows})
    lines: list[str] = []
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

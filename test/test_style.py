# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The house style: ament's flake8 and pep257 rules by ruff, headers, sizes, docstrings."""

import ast
import json
from pathlib import Path
import shutil
import subprocess
import sys

import pytest

ROOT = Path(__file__).resolve().parent.parent
SOURCES = sorted(path for folder in ('hooc_perception', 'test', 'launch', 'scripts')
                 for path in (ROOT / folder).rglob('*.py'))
HEADER = ('# Copyright 2026 The hooc_perception authors\n'
          '# SPDX-License-Identifier: Apache-2.0\n')
LONGEST_FILE = 400


def ruff():
    """Return the ruff of this environment, or of the PATH; skip where there is none."""
    found = Path(sys.executable).with_name('ruff')
    found = str(found) if found.exists() else shutil.which('ruff')
    if not found:
        pytest.skip('ruff is not installed here')
    return found


def test_ruff():
    run = subprocess.run([ruff(), 'check', '--no-cache', '--output-format=concise', '.'], cwd=ROOT,
                         capture_output=True, text=True)
    assert run.returncode == 0, run.stdout + run.stderr


def test_ruff_notices_what_ament_would(tmp_path):
    bad = tmp_path / 'bad.py'
    bad.write_text('import scipy\nimport numpy\n\n\ndef f(x):\n    """returns it"""\n'
                   '    y = "double"\n    return x\n')
    run = subprocess.run(
        [ruff(), 'check', '--no-cache', '--output-format=json', '--config',
         str(ROOT / 'pyproject.toml'), str(bad)], capture_output=True, text=True)
    found = {row['code'] for row in json.loads(run.stdout)}
    assert found >= {'I001', 'D100', 'D400', 'D401', 'D403', 'Q000', 'F841', 'F401'}


def test_spelling():
    run = subprocess.run([sys.executable, '-m', 'codespell_lib'], cwd=ROOT, capture_output=True,
                         text=True)
    if 'No module named' in run.stderr:
        pytest.skip('codespell is not installed here')
    assert run.returncode == 0, run.stdout + run.stderr


def test_every_file_carries_the_licence():
    bare = [str(path.relative_to(ROOT)) for path in SOURCES + [ROOT / 'setup.py']
            if not path.read_text().startswith(HEADER)]
    assert not bare


def test_no_file_is_too_long():
    long = {str(path.relative_to(ROOT)): count for path in SOURCES
            if (count := len(path.read_text().splitlines())) > LONGEST_FILE}
    assert not long


def undocumented(path):
    """Yield the public definitions of a module that have no docstring, the module included."""
    tree = ast.parse(path.read_text())
    if not ast.get_docstring(tree):
        yield 'module'
    scopes = [('', tree)]
    while scopes:
        prefix, scope = scopes.pop()
        for node in scope.body:
            if not isinstance(node, (ast.FunctionDef, ast.ClassDef, ast.AsyncFunctionDef)):
                continue
            # Properties' setters and overloads repeat a documented name.
            if node.name.startswith('_') or any(
                    ast.unparse(d).endswith(('.setter', 'overload', 'override'))
                    for d in node.decorator_list):
                continue
            if not ast.get_docstring(node):
                yield prefix + node.name
            if isinstance(node, ast.ClassDef):
                scopes.append((prefix + node.name + '.', node))


def test_everything_public_is_documented():
    bare = [f'{path.relative_to(ROOT)}: {name}'
            for path in sorted((ROOT / 'hooc_perception').rglob('*.py'))
            for name in undocumented(path)]
    assert not bare, '\n'.join(bare)


def test_undocumented_notices(tmp_path):
    path = tmp_path / 'm.py'
    path.write_text('class A:\n    """Say."""\n    def f(self): pass\n    def _g(self): pass\n'
                    'def h(): pass\n')
    assert sorted(undocumented(path)) == ['A.f', 'h', 'module']


@pytest.mark.parametrize('place', ['/ro' + 'ot/', '/ho' + 'me/', '/wo' + 'rk/'])
def test_no_machine_paths(place):
    found = [str(path.relative_to(ROOT)) for path in SOURCES if place in path.read_text()]
    assert not found

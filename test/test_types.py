# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The annotations of the package hold: pyright, as pyproject.toml configures it."""

import json
import os
from pathlib import Path
import subprocess
import sys

import pytest

ROOT = Path(__file__).resolve().parent.parent
# Its wheel bundles the JavaScript and the interpreter; a proxy that is closed proves it.
OFFLINE = {'HTTP_PROXY': 'http://127.0.0.1:9', 'HTTPS_PROXY': 'http://127.0.0.1:9'}


def pyright(*words):
    """Return what pyright says, as it prints it in JSON."""
    pytest.importorskip('pyright')
    run = subprocess.run([sys.executable, '-m', 'pyright', '--pythonpath', sys.executable,
                          '--outputjson', *words], cwd=ROOT, capture_output=True, text=True,
                         env={**os.environ, **OFFLINE})
    assert run.stdout, run.stderr
    return json.loads(run.stdout)


@pytest.mark.slow
def test_the_package_is_clean():
    said = pyright()
    assert said['summary']['filesAnalyzed'] > 200
    assert not [f"{Path(row['file']).relative_to(ROOT)}:{row['range']['start']['line'] + 1}: "
                f"{row['message']}" for row in said['generalDiagnostics']]


def test_pyright_notices_a_wrong_argument(tmp_path):
    path = tmp_path / 'wrong.py'
    path.write_text("from hooc_perception.core.geometry import inverse\n\ninverse('north')\n")
    assert pyright(str(path))['summary']['errorCount'] == 1

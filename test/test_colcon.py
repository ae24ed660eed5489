# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The package builds, tests and installs as ROS installations do it, in a copy of the sources."""

import os
from pathlib import Path
import shutil
import subprocess
import sys

from hooc_perception.io.bags.reader import BagScene
from hooc_perception.trained.folder import load_model_folder
import pytest

ROOT = Path(__file__).resolve().parent.parent
NODES = ['ingestion_node', 'classification_node', 'candidate_node', 'parsing_node', 'replay_node']
pytestmark = pytest.mark.colcon


def call(command, cwd):
    """Run a command in `cwd` with what colcon writes kept there; return its output."""
    environment = {**os.environ, 'COLCON_HOME': str(cwd / 'colcon'), 'NO_COLOR': '1'}
    # The variables of an outer build or test run are none of the inner one's business.
    for name in [name for name in environment if name.startswith(('PYTEST_', 'COV_'))]:
        del environment[name]
    run = subprocess.run(command, cwd=cwd, env=environment, text=True, stdin=subprocess.DEVNULL,
                         stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    assert run.returncode == 0, run.stdout[-4000:]
    return run.stdout


@pytest.fixture(scope='module')
def workspace(tmp_path_factory):
    """Return a colcon workspace with the committed files of the package, built."""
    colcon = Path(sys.executable).with_name('colcon')
    if not colcon.exists():
        pytest.skip('colcon is not installed in this environment')
    listing = subprocess.run(['git', 'ls-files', '-z'], cwd=ROOT, capture_output=True, text=True)
    if listing.returncode:
        pytest.skip('not a git checkout')
    workspace = tmp_path_factory.mktemp('workspace')
    for name in filter(None, listing.stdout.split('\0')):
        target = workspace / 'src' / 'hooc_perception' / name
        if (ROOT / name).is_file():
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(ROOT / name, target)
    call([str(colcon), 'build', '--event-handlers', 'console_direct+'], workspace)
    return workspace


def test_build_installs_everything(workspace):
    prefix = workspace / 'install' / 'hooc_perception'
    share = prefix / 'share'
    assert (share / 'ament_index/resource_index/packages/hooc_perception').exists()
    assert (share / 'hooc_perception/package.xml').exists()
    for node in NODES:
        assert os.access(prefix / 'lib/hooc_perception' / node, os.X_OK)
    for folder, pattern in (('launch', '*.launch.py'), ('config', '*')):
        assert ({path.name for path in (share / 'hooc_perception' / folder).glob('*')}
                == {path.name for path in (ROOT / folder).glob(pattern)})


def test_installed_package_is_complete(workspace):
    source = workspace / 'src' / 'hooc_perception' / 'hooc_perception'
    installed = next((workspace / 'install').glob('**/site-packages/hooc_perception'))
    wanted = {path.relative_to(source) for path in source.rglob('*') if path.is_file()}
    found = {path.relative_to(installed) for path in installed.rglob('*')}
    assert not {str(path) for path in wanted - found}


def test_executables_start_with_the_python_that_built(workspace):
    """A virtual environment next to ROS counts on it, see docs/installation.md."""
    for node in (*NODES, 'hooc'):
        text = (workspace / 'install/hooc_perception/lib/hooc_perception' / node).read_text()
        python = Path(text.partition('\n')[0].removeprefix('#!'))
        assert python.parent.resolve() == Path(sys.executable).parent.resolve()


def test_a_build_of_links_has_executables_and_the_bundle(workspace):
    call([sys.executable, '-m', 'colcon', 'build', '--symlink-install', '--build-base', 'linking',
          '--install-base', 'linked'], workspace)
    prefix = workspace / 'linked/hooc_perception'
    assert all(os.access(prefix / 'lib/hooc_perception' / node, os.X_OK) for node in NODES)
    share = prefix / 'share/hooc_perception'
    assert (share / 'models/demo/model.json').is_symlink()
    assert len(load_model_folder(share / 'models/demo').models) >= 5
    assert BagScene(share / 'bags/demo').depth_topics


def test_installed_command_runs(workspace):
    command = workspace / 'install/hooc_perception/lib/hooc_perception/hooc'
    site = next((workspace / 'install').glob('**/site-packages'))
    run = subprocess.run([str(command), '--help'], capture_output=True, text=True, cwd=workspace,
                         env={**os.environ, 'PYTHONPATH': str(site)})
    assert 'usage: hooc' in run.stdout, run.stderr


def test_colcon_test(workspace):
    colcon = str(Path(sys.executable).with_name('colcon'))
    call([colcon, 'test', '--event-handlers', 'console_direct+', '--return-code-on-test-failure',
          '--pytest-args', 'test/cli/test_main.py', 'test/test_layers.py'], workspace)
    result = call([colcon, 'test-result', '--all'], workspace)
    assert '0 errors, 0 failures' in result
    assert ' 0 tests' not in result

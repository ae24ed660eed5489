# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
The wheel, installed into an empty environment, is complete.

The environment sees of this one only what `[project] dependencies` names, with all that those
depend on: what an extra brings must not be needed. Nothing is downloaded.
"""

from importlib.metadata import distribution, PackageNotFoundError
import json
import os
from pathlib import Path
import shutil
import subprocess
import sys
import tomllib
import venv

from packaging.requirements import Requirement
import pytest

ROOT = Path(__file__).resolve().parent.parent
pytestmark = pytest.mark.slow


def closure(requirements):
    """Return the installed distributions that requirements need, their own included."""
    found, waiting = {}, [Requirement(row) for row in requirements]
    while waiting:
        requirement = waiting.pop()
        if requirement.marker and not requirement.marker.evaluate({'extra': ''}):
            continue
        name = requirement.name.lower().replace('_', '-')
        if name in found:
            continue
        try:
            found[name] = distribution(name)
        except PackageNotFoundError:
            pytest.skip(f'{name} is not installed here')
        waiting += [Requirement(row) for row in found[name].requires or ()]
    return list(found.values())


def link(distributions, site):
    """Link into `site` what the distributions have installed."""
    for one in distributions:
        tops = {file.parts[0] for file in one.files or () if not file.parts[0].startswith('..')}
        for top in tops - {'__pycache__'}:
            target = site / top
            if not target.exists():
                target.symlink_to(Path(one.locate_file(top)).resolve())


def lend_kernels(site):
    """
    Put what this tree has compiled beside the same sources in `site`.

    Compiling every kernel takes minutes. numba takes a kernel where its source has the size and
    the time of the one that was compiled; whatever is not there is compiled.
    """
    for source in (ROOT / 'hooc_perception').rglob('*.py'):
        copy = site / source.relative_to(ROOT)
        if copy.is_file() and copy.read_bytes() == source.read_bytes():
            state = source.stat()
            os.utime(copy, ns=(state.st_atime_ns, state.st_mtime_ns))
    for pattern in ('*.nb[ic]', 'hooc_perception.sources'):
        for compiled in (ROOT / 'hooc_perception').rglob(f'__pycache__/{pattern}'):
            place = site / compiled.relative_to(ROOT)
            place.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(compiled, place)


@pytest.fixture(scope='module')
def prefix(tmp_path_factory):
    """Return an environment with the plain dependencies and the wheel of this tree."""
    folder = tmp_path_factory.mktemp('wheel')
    source, prefix = folder / 'source', folder / 'env'
    # Built from the committed files: the tree may hold a stale build/ of its own.
    listing = subprocess.run(['git', 'ls-files', '-z'], cwd=ROOT, capture_output=True, text=True)
    if listing.returncode:
        pytest.skip('not a git checkout')
    for name in filter(None, listing.stdout.split('\0')):
        if (ROOT / name).is_file():
            (source / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(ROOT / name, source / name)
    pip = [sys.executable, '-m', 'pip', '--disable-pip-version-check']
    subprocess.run([*pip, 'wheel', '-q', '--no-deps', '--no-build-isolation', '-w', folder,
                    source], check=True, capture_output=True)
    wheel, = folder.glob('hooc_perception-*.whl')
    venv.create(prefix, with_pip=False)
    subprocess.run([*pip, '--python', prefix, 'install', '-q', '--no-deps', '--no-index', wheel],
                   check=True, capture_output=True)
    project = tomllib.loads((ROOT / 'pyproject.toml').read_text())['project']
    site, = (prefix / 'lib').glob('python*/site-packages')
    link(closure(project['dependencies']), site)
    lend_kernels(site)
    return prefix


def call(prefix, *words):
    """Run a program of the environment in its folder; return the finished process."""
    environment = {key: value for key, value in os.environ.items()
                   if not key.startswith(('PYTHON', 'COV_', 'LD_LIBRARY_PATH', '_ROS'))}
    return subprocess.run([str(prefix / 'bin' / words[0]), *words[1:]], cwd=prefix, text=True,
                          capture_output=True, env=environment, stdin=subprocess.DEVNULL)


def test_importing_the_package_imports_nothing_heavy(prefix):
    run = call(prefix, 'python', '-c', 'import sys, hooc_perception; '
               'print(hooc_perception.__version__, hooc_perception.__file__, '
               'sorted({"numpy", "scipy", "numba", "cv2"} & set(sys.modules)))')
    assert run.returncode == 0, run.stderr
    version, place, heavy = run.stdout.split(maxsplit=2)
    assert version and place.startswith(str(prefix)) and heavy.strip() == '[]'


def test_the_network_is_part_of_the_wheel(prefix):
    run = call(prefix, 'python', '-c', 'from hooc_perception.training.network.weights import '
               'bundled; print(len(bundled()["network_net"]))')
    assert run.returncode == 0 and int(run.stdout) > 1_000_000, run.stderr


def test_no_extra_is_there(prefix):
    run = call(prefix, 'python', '-c', 'import mujoco')
    assert 'ModuleNotFoundError' in run.stderr


def test_doctor_finds_no_error_and_names_the_extras(prefix):
    run = call(prefix, 'hooc', 'doctor')
    assert run.returncode == 0, run.stdout + run.stderr
    assert '0 errors' in run.stdout
    for extra in ('ros', 'train', 'eval', 'view'):
        assert f"pip install 'hooc_perception[{extra}]'" in run.stdout


def test_the_bundled_scene_is_parsed_and_reported(prefix):
    share = Path('share') / 'hooc_perception'
    run = call(prefix, 'hooc', 'parse', str(share / 'bags/demo'), '--model',
               str(share / 'models/demo'), '--out', 'out/results.json')
    assert run.returncode == 0, run.stdout + run.stderr
    scene, = json.loads((prefix / 'out/results.json').read_text())['scenes']
    assert len(scene['objects']) >= 5
    run = call(prefix, 'hooc', 'report', 'out/results.json', '--out', 'out')
    assert run.returncode == 0, run.stdout + run.stderr
    page = (prefix / 'out/report.html').read_text()
    assert page.rstrip().endswith('</html>') and scene['objects'][0]['category'] in page
    assert 'three.js authors' in page and 'OrbitControls' in page


@pytest.mark.parametrize('words, extra', [
    (['demo'], 'ros'), (['twin', '--out', 'out/twin'], 'train')])
def test_a_command_without_its_extra_names_it(prefix, words, extra):
    run = call(prefix, 'hooc', *words)
    assert run.returncode == 1
    assert f"pip install 'hooc_perception[{extra}]'" in run.stderr, run.stderr
    assert run.stderr.count('\n') == 1

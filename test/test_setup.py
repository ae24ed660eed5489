# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The environment that scripts/setup.sh makes."""

import importlib.util
import os
from pathlib import Path
import shutil
import subprocess
import sys

import pytest

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture
def tree(tmp_path):
    """Return a copy of what setup.sh needs, with a stand-in for the virtual environment."""
    for name in ('requirements.txt', 'pyproject.toml', 'setup.py', 'setup.cfg', 'package.xml',
                 'scripts/setup.sh', 'scripts/ros_first.py'):
        target = tmp_path / name
        target.parent.mkdir(exist_ok=True)
        shutil.copyfile(ROOT / name, target)
    python = tmp_path / '.venv/bin/python'
    python.parent.mkdir(parents=True)
    # Notes what it was asked to do; answers where setup.sh wants an answer.
    python.write_text('#!/bin/sh\necho "$@" >> calls.txt\n'
                      'case "$*" in *purelib*) echo "$PWD/site";; esac\n')
    python.chmod(0o755)
    (tmp_path / 'site').mkdir()
    return tmp_path


def set_up(tree):
    """Run setup.sh in a tree; return the lines that its Python was called with since."""
    calls = tree / 'calls.txt'
    calls.write_text('')
    subprocess.run(['bash', 'scripts/setup.sh'], cwd=tree, check=True, capture_output=True,
                   env={**os.environ, 'HOOC_NO_APT': '1'})
    return calls.read_text().splitlines()


def test_second_run_does_nothing(tree):
    first = set_up(tree)
    assert any('-r requirements.txt' in call for call in first)
    assert any('--editable .' in call for call in first)
    assert (tree / 'site/hooc_ros_first.pth').read_text() == 'import hooc_ros_first\n'
    assert not [call for call in set_up(tree) if 'pip' in call]


@pytest.mark.parametrize('name', ['requirements.txt', 'pyproject.toml', 'setup.py', 'package.xml'])
def test_a_change_sets_up_again(tree, name):
    set_up(tree)
    with open(tree / name, 'a') as file:
        file.write('\n')
    assert any('-r requirements.txt' in call for call in set_up(tree))


def test_a_moved_tree_sets_up_again(tree):
    set_up(tree)
    moved = tree.parent / 'moved'
    tree.rename(moved)
    assert any('pip install' in call for call in set_up(moved))


def pretender(folder):
    """Return a program called python3.12 that starts no Python, as a pyenv shim may be."""
    program = folder / 'python3.12'
    program.write_text('#!/bin/sh\necho "pyenv: python3.12: command not found" >&2\nexit 127\n')
    program.chmod(0o755)
    return program


def found_python(wanted, *first):
    """Return what setup.sh's search for Python prints, with HOOC_PYTHON and folders first."""
    text = (ROOT / 'scripts/setup.sh').read_text()
    functions = text[text.index('runs()'):text.index('if ! "$VENV/bin/python"')]
    run = subprocess.run(['bash', '-c', functions + '\nfind_python runs'], text=True,
                         capture_output=True, check=True, env={
                             **os.environ, 'HOOC_PYTHON': str(wanted),
                             'PATH': ':'.join((*map(str, first), os.environ['PATH']))})
    return run.stdout.strip()


def test_a_python_that_only_pretends_is_passed_over(tmp_path):
    assert not Path(found_python(sys.executable, pretender(tmp_path).parent)).is_relative_to(
        tmp_path)
    assert not Path(found_python('', pretender(tmp_path).parent)).is_relative_to(tmp_path)


def test_the_path_of_python_may_hold_spaces(tmp_path):
    folder = tmp_path / 'my tools'
    folder.mkdir()
    (folder / 'python 3').symlink_to(sys.executable)
    assert found_python(folder / 'python 3') == str(folder / 'python 3')


def test_a_python_that_is_asked_for_must_start(tree, tmp_path_factory):
    shutil.rmtree(tree / '.venv')
    wanted = pretender(tmp_path_factory.mktemp('my shims'))
    run = subprocess.run(['bash', 'scripts/setup.sh'], cwd=tree, capture_output=True, text=True,
                         env={**os.environ, 'HOOC_NO_APT': '1', 'HOOC_PYTHON': str(wanted)})
    assert run.returncode == 1
    assert f"HOOC_PYTHON='{wanted}' does not start Python 3.12 or 3.11" in run.stderr
    assert not (tree / '.venv').exists()


def test_this_environments_ros_wins_over_a_sourced_one(tmp_path):
    if not importlib.util.find_spec('hooc_ros_first'):
        pytest.skip('this environment was not made by scripts/setup.sh')
    for name, code in (('rclpy', 'raise ImportError("the wrong one")'), ('only_there', '')):
        (tmp_path / 'python' / name).mkdir(parents=True)
        (tmp_path / 'python' / name / '__init__.py').write_text(code)
    environment = {name: value for name, value in os.environ.items()
                   if name != '_ROS_WHEELS_BOOTSTRAP_COMPLETE'}
    environment.update(PYTHONPATH=str(tmp_path / 'python'), LD_LIBRARY_PATH=str(tmp_path / 'lib'))
    run = subprocess.run(
        [sys.executable, '-c', 'import os, rclpy, only_there; rclpy.init(); rclpy.shutdown();'
         'print(rclpy.__file__); print(os.environ["LD_LIBRARY_PATH"])'],
        env=environment, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    place, libraries = run.stdout.splitlines()
    assert place.startswith(sys.prefix)
    assert libraries.split(':')[0].startswith(sys.prefix)
    assert libraries.split(':')[-1] == str(tmp_path / 'lib')

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Where compiled kernels go when the package or the user's home is read-only, and when they go."""

import os
from pathlib import Path
import subprocess
import sys

from hooc_perception.core import kernel_cache
import pytest


@pytest.fixture
def read_only(monkeypatch, tmp_path):
    """Make everything called `locked` unwritable, also for root."""
    real = os.access
    monkeypatch.setattr(os, 'access', lambda path, mode:
                        'locked' not in str(path) and real(path, mode))
    (tmp_path / 'locked').mkdir()
    return tmp_path / 'locked'


def test_a_writable_package_needs_nothing(tmp_path):
    environment = {}
    kernel_cache.choose(environment, tmp_path)
    assert not environment


def test_the_users_cache_is_left_to_numba(read_only, tmp_path):
    environment = {'XDG_CACHE_HOME': str(tmp_path / 'cache')}
    kernel_cache.choose(environment, read_only)
    assert 'NUMBA_CACHE_DIR' not in environment


def test_without_a_home_a_private_folder_serves(read_only, tmp_path):
    environment = {'XDG_CACHE_HOME': str(read_only / 'cache')}
    kernel_cache.choose(environment, read_only, tmp_path)
    folder = Path(environment['NUMBA_CACHE_DIR'])
    assert folder.parent == tmp_path
    assert folder.stat().st_mode & 0o777 == 0o700
    again = {'XDG_CACHE_HOME': str(read_only / 'cache')}
    kernel_cache.choose(again, read_only, tmp_path)
    assert again == environment


def test_the_users_choice_wins(read_only):
    environment = {'NUMBA_CACHE_DIR': 'mine', 'XDG_CACHE_HOME': str(read_only)}
    kernel_cache.choose(environment, read_only)
    assert environment['NUMBA_CACHE_DIR'] == 'mine'


@pytest.mark.parametrize('plant', ['link', 'open to all'])
def test_a_planted_folder_is_not_trusted(tmp_path, plant):
    expected = tmp_path / f'hooc_perception-kernels-{os.getuid()}'
    if plant == 'link':
        (tmp_path / 'theirs').mkdir()
        expected.symlink_to(tmp_path / 'theirs')
    else:
        expected.mkdir()
        expected.chmod(0o777)
    folder = kernel_cache.private_folder(tmp_path)
    assert folder != expected
    assert folder.stat().st_mode & 0o777 == 0o700


def test_kernels_are_kept_in_the_chosen_folder(tmp_path):
    code = ('import numpy as np; from hooc_perception.core.kernels import raster; '
            'raster.project_vertices(np.ones((1, 3)), np.eye(3), np.zeros(3), 1., 1., 0., 0.)')
    subprocess.run([sys.executable, '-c', code], check=True,
                   env={**os.environ, 'NUMBA_CACHE_DIR': str(tmp_path)})
    assert list(tmp_path.rglob('*.nbc'))


@pytest.mark.parametrize('own_folder', [False, True])
def test_kernels_of_changed_sources_are_dropped(tmp_path, own_folder):
    """A kernel is compiled with those of other files inside: numba sees only its own file."""
    package, cache = tmp_path / 'hooc_perception', tmp_path / 'cache'
    (package / 'core/kernels').mkdir(parents=True)
    source = package / 'core/kernels/raster.py'
    source.write_text('1')
    environment = {'NUMBA_CACHE_DIR': str(cache)} if own_folder else {}
    kernel_cache.drop_stale(environment, package)
    folder = cache / 'kernels_1f' if own_folder else package / 'core/kernels/__pycache__'
    folder.mkdir(parents=True)
    index, other = folder / 'explain.explain_all-1.py311.nbi', cache / 'theirs_2e/mine.nbi'
    index.touch()
    other.parent.mkdir(parents=True)
    other.touch()
    kernel_cache.drop_stale(environment, package)
    assert index.exists()
    source.write_text('12')
    kernel_cache.drop_stale(environment, package)
    assert not index.exists()
    assert other.exists()

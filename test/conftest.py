# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Fixtures for all tests."""

import importlib.util
import os
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parent.parent


@pytest.fixture(scope='session')
def repository():
    """Return the root of the source tree."""
    return REPOSITORY


@pytest.fixture(scope='session')
def shared_scenes():
    """Return the folder of recorded scene sets beside the repository; skip where absent."""
    path = Path(os.environ.get('HOOC_SHARED_SCENES', REPOSITORY.parent / 'shared' / 'scenes'))
    if not path.is_dir():
        pytest.skip('no recorded scenes beside the repository (../shared/scenes)')
    return path


@pytest.fixture(scope='session')
def tabletop():
    """Return the module of rendered tables with boxes and cylinders (tabletop.py)."""
    spec = importlib.util.spec_from_file_location('tabletop', Path(__file__).with_name(
        'tabletop.py'))
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module

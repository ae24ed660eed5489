# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Kinds of cases for the fuzzer: damaged bags, read as every command reads them."""

from collections.abc import Callable
import functools
from pathlib import Path
import shutil
from types import SimpleNamespace
from typing import Any

from hooc_perception.benchmark.mutate import damaged
from hooc_perception.core.types import Camera, DepthView
from hooc_perception.diagnosis.bag import check_bag
from hooc_perception.errors import HoocError
from hooc_perception.io.bags.files import iter_messages
from hooc_perception.io.bags.mcap_format import records
from hooc_perception.io.bags.reader import BagScene
from hooc_perception.io.bags.salvage import salvage_bag
from hooc_perception.io.bags.writer import write_bag
import numpy as np

_W, _H = 32, 24


def small_scene() -> tuple[Any, Any]:
    """Return (scene, scene set) for write_bag: two small cameras above a table with a step."""
    T = np.array([[1.0, 0, 0, 0], [0, -1, 0, 0], [0, 0, -1, 1], [0, 0, 0, 1]])
    K = np.array([[30.0, 0, 15.5], [0, 30, 11.5], [0, 0, 1]])
    cameras = tuple(Camera(name, _W, _H, K, np.zeros(5), T) for name in ('left', 'right'))
    depth = np.ones((_H, _W), np.float32)
    depth[8:16, 10:22] = 0.9
    scene = SimpleNamespace(
        name='small', cameras=cameras, truth=None, world={}, depth_units=(0.001,) * 2,
        labels=lambda: None, depth=lambda: tuple(DepthView(c, depth) for c in cameras))
    return scene, SimpleNamespace(name='fuzz', world_frame='table', category_names=('box',),
                                  max_instances=1)


@functools.lru_cache
def _originals(folder: Path) -> dict[str, Path]:
    """Write the undamaged bags once; return {storage: path}."""
    return {storage: write_bag(*small_scene(), folder / f'good_{storage}', storage, repeat=3)
            for storage in ('mcap', 'sqlite3')}


def _bag(rng: np.random.Generator, folder: Path, storage: str, what: str = 'file',
         sealed: bool = True) -> Path:
    """Return a damaged copy of a bag."""
    source = _originals(folder)[storage]
    bag = folder / 'case' / source.name
    shutil.rmtree(bag.parent, ignore_errors=True)
    shutil.copytree(source, bag)
    path = bag / 'metadata.yaml' if what == 'metadata' else next(
        f for f in bag.iterdir() if f.suffix in ('.mcap', '.db3'))
    data = path.read_bytes()
    if not sealed:
        data = _without_checksums(data)
    path.write_bytes(damaged(data, rng))
    if what == 'alone':
        (bag / 'metadata.yaml').unlink()
        return path
    return bag


def _without_checksums(data: bytes) -> bytes:
    """Return an MCAP file as most recorders leave it, so that damage reaches the messages."""
    out = bytearray(data)
    for opcode, at, _ in list(records(data)):
        if opcode == 6:
            out[at + 24:at + 28] = bytes(4)
        elif opcode == 15:
            out[at:at + 4] = bytes(4)
        elif opcode == 2:
            out[at + 16:at + 20] = bytes(4)
    return bytes(out)


def _read(bag: Path) -> None:
    """Do with a bag what `hooc run` and `hooc doctor` do, then salvage it."""
    first: HoocError | None = None
    for action in (lambda: BagScene(bag).views(), lambda: list(iter_messages(bag)),
                   lambda: salvage_bag(bag)):
        try:
            action()
        except HoocError as error:
            first = first or error
    for finding in check_bag(bag):
        if '\n' in finding.text or not finding.text:
            raise HoocError(finding.text)
    if first:
        raise first


def bag_cases() -> dict[str, Callable[[np.random.Generator, Path], None]]:
    """Return {kind: function(rng, folder)}."""
    return {
        'mcap bag': lambda rng, folder: _read(_bag(rng, folder, 'mcap')),
        'mcap bag without checksums': lambda rng, folder: _read(
            _bag(rng, folder, 'mcap', sealed=False)),
        'mcap file': lambda rng, folder: _read(
            _bag(rng, folder, 'mcap', 'alone', sealed=False)),
        'sqlite bag': lambda rng, folder: _read(_bag(rng, folder, 'sqlite3')),
        'metadata': lambda rng, folder: _read(_bag(rng, folder, 'mcap', 'metadata')),
    }

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Batches of examples: turned, mirrored and stretched at random."""

from collections.abc import Sequence
from typing import NamedTuple

from hooc_perception.core.classification.table_network import (
    CELL_M,
    channels,
    POINT_FEATURES,
    point_features,
)
from hooc_perception.training.network.examples import Example
import numpy as np
import torch  # pyright: ignore[reportMissingImports]
from torch.nn import functional  # pyright: ignore[reportMissingImports]

# The class of places in a batch that an example does not fill.
NO_POINT = -1


class Batch(NamedTuple):
    """
    What a PointNetwork takes, and the true classes.

    :ivar maps, places, points: as PointNetwork.forward.
    :ivar y: (B, n) int64 classes, NO_POINT where there is no point.
    """

    maps: torch.Tensor
    places: torch.Tensor
    points: torch.Tensor
    y: torch.Tensor


def batch(examples: Sequence[Example], n: int, rng: np.random.Generator | None = None,
          stretch: float = 0.0) -> Batch:
    """
    Return a Batch.

    :param n: most points of each example; a random choice where there are more.
    :param rng: draws an angle, a reflection and a stretch of each; None = none of them, and the
        first n points.
    :param stretch: standard deviation of the logarithm of the stretch along both sides.
    """
    count = len(examples)
    places = torch.zeros(count, n, 2)
    y = torch.full((count, n), NO_POINT)
    turns, warps = _motions(count, rng, stretch)
    maps, points = [], torch.zeros(count, n, POINT_FEATURES)
    for k, example in enumerate(examples):
        rows = np.arange(len(example.y))
        if rng is not None:
            rows = rng.permutation(rows)
        rows = rows[:n]
        surface, m = example.surface, len(rows)
        side = CELL_M * example.slices.shape[1]
        flat = torch.from_numpy((surface.points[rows, :2] + CELL_M / 2) / side * 2 - 1).float()
        places[k, :m] = (flat @ torch.linalg.inv(warps[k]).T).flip(1)
        features = torch.from_numpy(point_features(surface)[rows])
        normal = slice(-4, -2)
        features[:, normal] = features[:, normal] @ torch.linalg.inv(turns[k]).T
        points[k, :m] = features
        y[k, :m] = torch.from_numpy(example.y[rows].astype(np.int64))
        maps.append(torch.from_numpy(channels(example.slices, example.layers.astype(np.float32))))
    whole = torch.stack(maps)
    if rng is not None:
        # affine_grid names the last axis of a map first.
        swapped = warps.flip(1).flip(2)
        grid = functional.affine_grid(torch.cat([swapped, torch.zeros(count, 2, 1)], 2),
                                      list(whole.shape), align_corners=False)
        whole = functional.grid_sample(whole, grid, padding_mode='border', align_corners=False)
    return Batch(whole.contiguous(memory_format=torch.channels_last), places, points, y)


def _motions(count: int, rng: np.random.Generator | None,
             stretch: float) -> tuple[torch.Tensor, torch.Tensor]:
    """Return (B, 2, 2) turns with reflections, and the same with a stretch: from new to old."""
    if rng is None:
        return torch.eye(2).repeat(count, 1, 1), torch.eye(2).repeat(count, 1, 1)
    angle = rng.uniform(0, 2 * np.pi, count)
    mirror = np.where(rng.random(count) < 0.5, -1.0, 1.0)
    cos, sin = np.cos(angle), np.sin(angle)
    turns = np.stack([np.stack([cos, -sin * mirror], 1), np.stack([sin, cos * mirror], 1)], 1)
    sides = np.exp(stretch * rng.standard_normal((count, 1, 2)))
    return torch.from_numpy(turns).float(), torch.from_numpy(turns * sides).float()

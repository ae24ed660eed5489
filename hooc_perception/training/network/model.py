# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The network over the table in PyTorch, as it is trained."""

from collections.abc import Sequence

from hooc_perception.core.classification.table_network import CHANNELS, LEVELS, POINT_FEATURES
import torch  # pyright: ignore[reportMissingImports]
from torch import nn  # pyright: ignore[reportMissingImports]
from torch.nn import functional  # pyright: ignore[reportMissingImports]

# Channels of the levels, of what each gives to the perceptron, and of the perceptron's layers.
WIDTHS = (64, 96, 160, 224)
TAPS = 48
HIDDEN = (192, 96)
DROPOUT = 0.1


class Levels(nn.Module):
    """A U-Net with residual blocks: from maps of half the cells to LEVELS outputs."""

    def __init__(self) -> None:
        super().__init__()
        self.stem = _convolution(4 * CHANNELS, WIDTHS[0])
        self.down = nn.ModuleList(
            _Block(WIDTHS[max(k - 1, 0)], WIDTHS[k]) for k in range(LEVELS))
        self.up = nn.ModuleList(
            nn.Sequential(_convolution(WIDTHS[k] + WIDTHS[k + 1], WIDTHS[k]),
                          _convolution(WIDTHS[k], WIDTHS[k])) for k in range(LEVELS - 1))
        self.taps = nn.ModuleList(nn.Conv2d(width, TAPS, 1) for width in WIDTHS)

    def forward(self, maps: torch.Tensor) -> tuple[torch.Tensor, ...]:
        """Return (B, TAPS, nx / 2^(k+1), ny / 2^(k+1)) of each level k."""
        x, kept = self.stem(maps), []
        for k, block in enumerate(self.down):
            x = block(functional.max_pool2d(x, 2) if k else x)
            kept.append(x)
        for k in reversed(range(LEVELS - 1)):
            x = self.up[k](torch.cat([kept[k], functional.interpolate(x, scale_factor=2)], 1))
            kept[k] = x
        return tuple(tap(level) for tap, level in zip(self.taps, kept))


class PointNetwork(nn.Module):
    """
    The Levels and the perceptron that classifies points by them.

    :param classes: number of classes, with background.
    """

    def __init__(self, classes: int) -> None:
        super().__init__()
        self.levels = Levels()
        sizes = (LEVELS * TAPS + POINT_FEATURES, *HIDDEN)
        hidden = [layer for a, b in zip(sizes, sizes[1:])
                  for layer in (nn.Linear(a, b), nn.ReLU(), nn.Dropout(DROPOUT))]
        self.perceptron = nn.Sequential(*hidden, nn.Linear(sizes[-1], classes))

    def forward(self, maps: torch.Tensor, places: torch.Tensor,
                points: torch.Tensor) -> torch.Tensor:
        """
        Return (B, n, classes) logits.

        :param maps: (B, CHANNELS, nx, ny), see table_network.channels.
        :param places: (B, n, 2) of the points: y and x, the map reaching from -1 to 1.
        :param points: (B, n, POINT_FEATURES).
        """
        levels = self.levels(functional.pixel_unshuffle(maps, 2))
        taps = [functional.grid_sample(level.float(), places[:, :, None], padding_mode='border',
                                       align_corners=False)[..., 0].transpose(1, 2)
                for level in levels]
        return self.perceptron(torch.cat([*taps, points], 2))

    def linear_layers(self) -> Sequence[nn.Linear]:
        """Return the layers of the perceptron that have weights, from first to last."""
        return [layer for layer in self.perceptron if isinstance(layer, nn.Linear)]


class _Block(nn.Module):
    """Two convolutions with a residual connection (He et al. 2016)."""

    def __init__(self, inner: int, outer: int) -> None:
        super().__init__()
        self.first = _convolution(inner, outer)
        self.second = nn.Sequential(nn.Conv2d(outer, outer, 3, padding=1, bias=False),
                                    nn.BatchNorm2d(outer))
        self.skip = (nn.Identity() if inner == outer
                     else nn.Conv2d(inner, outer, 1, bias=False))

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """Return (B, outer, nx, ny)."""
        return functional.relu(self.second(self.first(x)) + self.skip(x))


def _convolution(inner: int, outer: int) -> nn.Sequential:
    """Return a 3 x 3 convolution with batch normalization and rectification."""
    return nn.Sequential(nn.Conv2d(inner, outer, 3, padding=1, bias=False),
                         nn.BatchNorm2d(outer), nn.ReLU())

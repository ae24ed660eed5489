# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Fitting of the network over the table by stochastic gradient descent."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from hooc_perception.core.config import Config, param
from hooc_perception.training.network.batches import batch, NO_POINT
from hooc_perception.training.network.examples import Example
from hooc_perception.training.network.model import PointNetwork
import numpy as np
import torch  # pyright: ignore[reportMissingImports]
from torch.nn import functional  # pyright: ignore[reportMissingImports]

WARM_UP_STEPS = 100
LARGEST_GRADIENT = 2.0


@dataclass(frozen=True)
class NetworkFitConfig(Config):
    """Parameters of the descent."""

    passes: int = param(18, 'Passes over the examples.', '', 1, 10000)
    batch: int = param(8, 'Examples per step.', '', 1, 1000)
    points: int = param(1200, 'Most points of an example per step.', '', 10, 100000)
    rate: float = param(2e-3, 'Largest learning rate; it falls along a cosine.', '', 1e-6, 1.0)
    decay: float = param(0.02, 'Weight decay (AdamW).', '', 0.0, 1.0)
    smoothing: float = param(0.05, 'Probability that a label gives away to all classes.', '', 0.0,
                             0.5)
    stretch: float = param(0.08, 'Standard deviation of the logarithm by which maps are stretched '
                           'along both sides.', '', 0.0, 0.5)
    held_out: int = param(60, 'Examples that only measure the accuracy.', '', 1, 10000)


def fit(examples: Sequence[Example], classes: int, config: NetworkFitConfig, seed: int,
        report: Callable[[str], object]) -> PointNetwork:
    """
    Return a PointNetwork trained on the examples but the first `held_out`.

    Equal seeds give nearly equal networks: PyTorch's gradients depend on the number of threads.

    :param classes: number of classes, with background.
    :param report: called with a line of text after every pass.
    """
    rng = np.random.default_rng(seed)
    torch.manual_seed(seed)
    held_out, seen = examples[:config.held_out], examples[config.held_out:]
    network = PointNetwork(classes).to(memory_format=torch.channels_last)
    descent = torch.optim.AdamW(network.parameters(), lr=config.rate, weight_decay=config.decay)
    per_pass = len(seen) // config.batch
    total = per_pass * config.passes
    for number in range(config.passes):
        order, losses = rng.permutation(len(seen)), []
        for k in range(per_pass):
            step = number * per_pass + k
            for group in descent.param_groups:
                group['lr'] = config.rate * min(1, (step + 1) / WARM_UP_STEPS) * (
                    0.5 + 0.5 * np.cos(np.pi * step / total))
            chosen = [seen[i] for i in order[k * config.batch:(k + 1) * config.batch]]
            losses.append(_step(network, descent, chosen, config, rng))
        report(f'pass {number + 1} of {config.passes}: loss {np.mean(losses):.3f}, held out '
               f'{accuracy(network, held_out):.3f} right')
    return network.eval()


def _step(network: PointNetwork, descent: torch.optim.Optimizer, chosen: Sequence[Example],
          config: NetworkFitConfig, rng: np.random.Generator) -> float:
    """Take one step of the descent; return the loss before it."""
    maps, places, points, y = batch(chosen, config.points, rng, config.stretch)
    with torch.autocast('cpu', torch.bfloat16):
        logits = network(maps, places, points)
    loss = functional.cross_entropy(logits.float().flatten(0, 1), y.flatten(),
                                    ignore_index=NO_POINT, label_smoothing=config.smoothing)
    descent.zero_grad()
    loss.backward()
    torch.nn.utils.clip_grad_norm_(network.parameters(), LARGEST_GRADIENT)
    descent.step()
    return float(loss.item())


def accuracy(network: PointNetwork, examples: Sequence[Example]) -> float:
    """Return the share of object points whose most likely class is the true one."""
    network.eval()
    right = total = 0
    with torch.no_grad():
        for example in examples:
            maps, places, points, y = batch([example], len(example.y))
            likely = network(maps, places, points).argmax(2)
            right += int(((likely == y) & (y > 0)).sum())
            total += int((y > 0).sum())
    network.train()
    return right / max(total, 1)

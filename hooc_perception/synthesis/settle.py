# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Let objects come to rest on the table by physics: stacked, leaning, in any pose."""

from collections.abc import Sequence
from dataclasses import replace

from hooc_perception.core.memo import latest
from hooc_perception.core.types import GenericModel
from hooc_perception.errors import HoocError
from hooc_perception.synthesis.bodies import Body, body_maker
from hooc_perception.synthesis.pile import Pile, SettleConfig
from hooc_perception.synthesis.population import Population
from hooc_perception.synthesis.scatter import models_key, PlacedObject, ScatterConfig
from hooc_perception.synthesis.strangers import Strangers
import numpy as np
from scipy.spatial import ConvexHull

# Of the numbers of strangers from -NO_STRANGERS to the most, those below one mean none.
NO_STRANGERS = 2


def settle(bodies: Sequence[Body], rng: np.random.Generator,
           config: SettleConfig = SettleConfig()) -> list[PlacedObject]:
    """
    Drop the bodies in random order and return those that came to rest.

    :return: objects that lie on the table within reach, poses of the bounding-box centres, in
        the order of dropping.
    """
    if not bodies:
        return []
    areas = np.array([_footprint(body) for body in bodies])
    order = rng.permutation(len(bodies))
    if config.large_first:
        order = np.argsort(-areas * np.exp(0.5 * rng.standard_normal(len(bodies))))
    pile = Pile([bodies[i] for i in order], config)
    radius = np.sqrt(areas.sum() / (np.pi * config.crowding))
    for i in range(len(bodies)):
        pile.release(i, radius, rng)
        pile.run(config.between_s)
    pile.run_to_rest()
    return [placed for i in range(len(bodies)) if (placed := pile.placed(i)) is not None]


def settled_models(models: Sequence[GenericModel], rng: np.random.Generator,
                   scatter: ScatterConfig, strength: float,
                   config: SettleConfig = SettleConfig(), population: Population = (),
                   fold: int | None = None, strangers: int = 0) -> list[PlacedObject]:
    """
    Return a settled arrangement of a random subset of models.

    Each arrangement varies the config; see `varied`.

    :param scatter: gives the range of counts, the repeats and the spread of sizes.
    :param strength: how far the objects depart from the generic shapes.
    :param population: relatives of the models, from which objects are made as well.
    :param fold: make objects only from relatives of this fold, where there are any.
    :param strangers: most things of no category among them; in some scenes there are none.
    :raises HoocError: if there are no models.
    """
    if not models:
        raise HoocError('a settled scene needs at least one model, but there are none; '
                        'add categories to the set')
    maker = body_maker(models, population)
    count = int(rng.integers(scatter.objects_low, scatter.objects_high + 1))
    chosen = rng.permutation(np.tile(np.arange(len(models)), scatter.repeats))[:count] + 1
    bodies = [maker.body(int(c), rng, strength, fold=fold) for c in chosen]
    if scatter.size_spread > 0:
        factors = np.clip(rng.standard_normal(len(bodies)), -2, 2) * scatter.size_spread
        bodies = [body.scaled(factor) for body, factor in zip(bodies, np.exp(factors))]
    if strangers:
        stranger = strangers_beside(models)
        bodies += [stranger.body(rng, strength)
                   for _ in range(max(0, int(rng.integers(-NO_STRANGERS, strangers + 1))))]
    return settle(bodies, rng, varied(config, rng))


@latest(4, key=models_key)
def strangers_beside(models: Sequence[GenericModel]) -> Strangers:
    """Return this process's Strangers to the models."""
    return Strangers([model.name for model in models])


def varied(config: SettleConfig, rng: np.random.Generator) -> SettleConfig:
    """Return a copy of the config with a random manner of placing: tidier, or more of a heap."""
    return replace(config, upright=float(rng.uniform(0.3, 0.9)),
                   crowding=float(config.crowding * np.exp(rng.normal(0, 0.3))),
                   places=int(rng.integers(1, 5)), large_first=bool(rng.random() < 0.5))


def _footprint(body: Body) -> float:
    """Return the area that a body covers when it lies on its broadest side, m^2."""
    broad = np.argsort(np.ptp(body.vertices, axis=0))[1:]
    return ConvexHull(body.vertices[:, broad], qhull_options='QJ').volume

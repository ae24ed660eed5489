# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
The three profiles: configurations of the same parts.

`paper` is the method of Basevi & Leonardis (2016) to the number, `best` (the default) goes
beyond it as far as it can, `fast` trades some of that for time.
"""

from dataclasses import dataclass, fields, replace

from hooc_perception.chain import PROFILES, STAGES
from hooc_perception.core.classification.classify import ClassifyConfig
from hooc_perception.core.hypotheses.propose import ProposeConfig
from hooc_perception.core.parsing.parse import ParseConfig
from hooc_perception.core.segment.config import ObserveConfig
from hooc_perception.errors import HoocError


@dataclass(frozen=True)
class Profile:
    """The parameters of all four stages under one name."""

    name: str = 'best'
    observe: ObserveConfig = ObserveConfig()
    classify: ClassifyConfig = ClassifyConfig()
    propose: ProposeConfig = ProposeConfig()
    parse: ParseConfig = ParseConfig()


def profile(name):
    """
    Return the Profile of that name.

    :raises HoocError: where there is none, with the names that there are.
    """
    if name == 'best':
        return Profile()
    if name == 'paper':
        return Profile('paper', observe=ObserveConfig(uneven_m=0.0, min_foreground_m=0.005),
                       propose=ProposeConfig(method='fragments'),
                       parse=ParseConfig(search='genetic', rounds=0))
    if name == 'fast':
        return Profile('fast', classify=ClassifyConfig(stride=3),
                       propose=ProposeConfig(samples=2500, pool=30, refine_steps=12, polish=6,
                                             polish_steps=6, per_category=8, round_samples=1000,
                                             round_pool=10, round_per_category=3),
                       parse=ParseConfig(rounds=1, polish_steps=10, turn_steps=6, patience=2,
                                         finalists=4))
    raise HoocError(f'there is no profile {name!r}; choose one of {", ".join(PROFILES)}')


def with_overrides(chosen, overrides):
    """
    Return a Profile with single parameters changed.

    :param overrides: {'stage.parameter': value}.
    :raises HoocError: where a name is unknown or a value refused.
    """
    for key, value in overrides.items():
        stage, _, name = key.partition('.')
        config = getattr(chosen, stage) if stage in STAGES else None
        if config is None or name not in {f.name for f in fields(config)}:
            raise HoocError(f'there is no parameter {key!r}; parameters are named '
                            'STAGE.NAME with the stages observe, classify, propose, parse')
        chosen = replace(chosen, **{stage: replace(config, **{name: value})})
    return chosen

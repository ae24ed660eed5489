# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
The three profiles: a method with its parameters under one name.

`paper` is the method of Basevi & Leonardis (2016) to the number, `best` (the default) the joint
method at its most accurate, `fast` the same with less computation.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from hooc_perception.chain import PROFILES, STAGES
from hooc_perception.core.classification.classify import ClassifyConfig
from hooc_perception.core.config import Config
from hooc_perception.core.hypotheses.propose import ProposeConfig
from hooc_perception.core.methods.fragments import FragmentConfig
from hooc_perception.core.methods.joint import JointMethod
from hooc_perception.core.methods.paper import PaperMethod, PaperParseConfig
from hooc_perception.core.methods.protocol import Method
from hooc_perception.core.parsing.config import ParseConfig
from hooc_perception.core.parsing.verifier import Verifier
from hooc_perception.core.segment.config import AccumulateConfig, ObserveConfig
from hooc_perception.errors import HoocError


@dataclass(frozen=True)
class Profile:
    """
    The parameters of all four stages under one name.

    :ivar propose: FragmentConfig in the paper's method, ProposeConfig in the joint one.
    :ivar parse: PaperParseConfig or ParseConfig, accordingly.
    """

    name: str = 'best'
    observe: ObserveConfig = ObserveConfig()
    classify: ClassifyConfig = ClassifyConfig()
    propose: ProposeConfig | FragmentConfig = ProposeConfig()
    parse: ParseConfig | PaperParseConfig = ParseConfig()

    def method(self, verifier: Verifier | None = None) -> Method:
        """
        Return the method with these parameters.

        :param verifier: of the model; the paper's method has none.
        """
        if isinstance(self.propose, FragmentConfig):
            assert isinstance(self.parse, PaperParseConfig)
            return PaperMethod(self.propose, self.parse)
        assert isinstance(self.parse, ParseConfig)
        return JointMethod(self.propose, self.parse, verifier)

    def stage(self, name: str) -> Config:
        """Return the parameters of one of the STAGES."""
        stages: dict[str, Config] = {'observe': self.observe, 'classify': self.classify,
                                     'propose': self.propose, 'parse': self.parse}
        return stages[name]


def profile(name: str) -> Profile:
    """
    Return the Profile of that name.

    :raises HoocError: where there is none, with the names that there are.
    """
    if name == 'best':
        return Profile()
    if name == 'paper':
        return Profile('paper', observe=ObserveConfig(uneven_m=0.0, min_foreground_m=0.005,
                                                      accumulate=AccumulateConfig(1)),
                       propose=FragmentConfig(), parse=PaperParseConfig())
    if name == 'fast':
        return Profile('fast', classify=ClassifyConfig(stride=3),
                       propose=ProposeConfig(samples=5000, pool=30, refine_steps=12, polish=6,
                                             polish_steps=6, per_category=8, round_samples=1000,
                                             round_pool=10, round_per_category=3),
                       parse=_fast_parse())
    raise HoocError(f'there is no profile {name!r}; choose one of {", ".join(PROFILES)}')


def _fast_parse() -> ParseConfig:
    best = ParseConfig()
    return replace(best, rounds=1, polish_steps=10, turn_steps=6, finalists=4,
                   search=replace(best.search, patience=2),
                   # Its verifier sees no unfamiliar shapes in training: it is believed less.
                   verdict=replace(best.verdict, verify_weight=80.0))


def with_overrides(chosen: Profile, overrides: Mapping[str, Any]) -> Profile:
    """
    Return a Profile with single parameters changed.

    :param overrides: {'stage.parameter': value}.
    :raises HoocError: where a name is unknown, where the profile's method has no such parameter,
        or where a value is out of its range.
    """
    for key, value in overrides.items():
        stage, _, name = key.partition('.')
        if stage not in STAGES or name not in chosen.stage(stage).parameters():
            raise HoocError(why_not(key, chosen.name))
        chosen = replace(chosen, **{stage: chosen.stage(stage).changed({name: value})})
    return chosen


def profiles_with(key: str) -> list[str]:
    """Return the names of the profiles whose method has a parameter 'stage.name'."""
    stage, _, parameter = key.partition('.')
    return [name for name in PROFILES if stage in STAGES
            and parameter in profile(name).stage(stage).parameters()]


def why_not(key: str, name: str) -> str:
    """Return the sentence on a parameter 'stage.name' that the profile `name` does not have."""
    others = profiles_with(key)
    if others:
        return (f'parameter {key} has no effect in the profile {name}: only the method of '
                f'{" and ".join(others)} has it; leave it out or choose such a profile')
    return (f'there is no parameter {key!r}; parameters are named STAGE.NAME with the stages '
            f'{", ".join(STAGES)}')

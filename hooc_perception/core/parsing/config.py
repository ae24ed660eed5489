# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Parameters of joint parsing."""

from dataclasses import dataclass

from hooc_perception.core.config import Config, group, param
from hooc_perception.core.energy.local_search import LocalSearchConfig
from hooc_perception.core.frame.costs import ObjectCosts, PixelCosts


@dataclass(frozen=True)
class VerdictConfig(Config):
    """How much the verifier's probabilities count against the energy."""

    verify_weight: float = param(160.0, 'Weight of the log odds that the verifier gives a '
                                 'candidate; 0 = the energy decides alone.', 'px', 0.0, 1000.0)
    missing_against_false: float = param(3.0, 'How much worse a missed object is than a false '
                                         'one.', '', 0.01, 100.0)
    least_cost: float = param(40.0, 'Least cost of an object, however probable, where a category '
                              'may occur more than once.', 'px', 0.0, 1e4)


@dataclass(frozen=True)
class OpenWorldConfig(Config):
    """What a model that was trained among strangers makes of them; without effect for others."""

    reject_below: float = param(0.3, 'An object whose score is below this is rejected: what it '
                                'explained may be something of no category.', '', 0.0, 1.0)
    least_unknown_score: float = param(0.1, 'Things of no category whose score is below this are '
                                       'not reported: they are rather the rest of an object.',
                                       '', 0.0, 1.0)


@dataclass(frozen=True)
class ReviseConfig(Config):
    """How the previous answer is revised; only `update` does so."""

    revise_rounds: int = param(1, 'Rounds of refinement and re-proposal where something has '
                               'changed.', low=0)
    revise_gain: float = param(
        40.0, 'Where nothing has changed, another object must be better by this to replace '
        'that of the previous answer.', 'px', 0.0, 1e5, runtime=True)


@dataclass(frozen=True)
class ParseConfig(Config):
    """
    Parameters of stage 4 of the joint method.

    :ivar search: of the discrete search; `pixels` and `objects` of the joint energy, `verdict`
        of the verifier, `open_world` of things of no category, `revise` of later frame sets.
    """

    rounds: int = param(3, 'Rounds of refinement and re-proposal.', low=0)
    kept: int = param(12, 'Candidates per category, beside the chosen ones, that go on to the '
                      'next round.', low=1)
    finalists: int = param(8, 'Candidates per category, beside the chosen ones, that are compared '
                           'in full resolution.', low=1)
    polish_steps: int = param(60, 'Refinement steps of a chosen object.', low=0)
    turn_steps: int = param(10, 'Refinement steps of a chosen object after half a turn about each '
                            'of its axes; 0 = no such turns.', low=0)
    member_steps: int = param(6, 'Refinement steps of a chosen object after its mesh was '
                              'exchanged for another one of its family; 0 = no exchange.', low=0)
    deadline_s: float = param(0.0, 'Seconds after which the best subset so far is the result; 0 '
                              '= none.', 's', 0.0, 3600.0, runtime=True)
    search: LocalSearchConfig = group(LocalSearchConfig(patience=8))
    pixels: PixelCosts = group(PixelCosts())
    objects: ObjectCosts = group(ObjectCosts())
    verdict: VerdictConfig = group(VerdictConfig())
    open_world: OpenWorldConfig = group(OpenWorldConfig())
    revise: ReviseConfig = group(ReviseConfig())

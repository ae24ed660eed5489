# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Remember what is derived from generic models: the only caches of the package."""

from collections import OrderedDict
from collections.abc import Callable, Hashable
import functools
from typing import ParamSpec, TypeVar
import weakref

from hooc_perception.core.types import GenericModel

T = TypeVar('T')
P = ParamSpec('P')


def per_model(derive: Callable[[GenericModel], T]) -> Callable[[GenericModel], T]:
    """
    Decorate a function of one GenericModel so that it is computed once per model.

    Models are frozen and hold arrays, so they are told apart by identity; an entry goes when
    its model does.
    """
    known: dict[int, T] = {}

    @functools.wraps(derive)
    def remembered(model: GenericModel) -> T:
        key = id(model)
        if key not in known:
            known[key] = derive(model)
            weakref.finalize(model, known.pop, key, None)
        return known[key]

    return remembered


def latest(count: int,
           key: Callable[P, Hashable]) -> Callable[[Callable[P, T]], Callable[P, T]]:
    """
    Decorate a function so that its results for the latest `count` keys are kept.

    For worker processes, which get equal but not identical models with every task.

    :param key: returns a hashable key of the arguments; equal keys must mean equal results.
    """
    def decorate(make: Callable[P, T]) -> Callable[P, T]:
        known: OrderedDict[Hashable, T] = OrderedDict()

        @functools.wraps(make)
        def remembered(*args: P.args, **kwargs: P.kwargs) -> T:
            of = key(*args, **kwargs)
            if of not in known:
                while len(known) >= count:
                    known.popitem(last=False)
                known[of] = make(*args, **kwargs)
            return known[of]

        return remembered

    return decorate

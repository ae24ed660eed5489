# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Remember what is derived from a generic model for as long as the model lives."""

from collections.abc import Callable
import functools
from typing import TypeVar
import weakref

from hooc_perception.core.types import GenericModel

T = TypeVar('T')


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

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Remember what is derived from a generic model for as long as the model lives."""

import functools
import weakref


def per_model(derive):
    """
    Decorate a function of one GenericModel so that each model is worked out once.

    Models are frozen and hold arrays, so they are told apart by identity; an entry goes when
    its model does.
    """
    known = {}

    @functools.wraps(derive)
    def remembered(model):
        key = id(model)
        if key not in known:
            known[key] = derive(model)
            weakref.finalize(model, known.pop, key, None)
        return known[key]

    return remembered

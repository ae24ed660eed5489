# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Teacup, glass, jug, bottle and bowl: vessels made on a lathe, with handles."""

from collections.abc import Callable

from hooc_perception.objects.catalogue import bottles, bowls, cups, glasses, jugs
from hooc_perception.objects.catalogue.draw import Draw
from manifold3d import Manifold

STYLES: dict[str, tuple[Callable[[Draw], Manifold], ...]] = {
    **cups.STYLES, **glasses.STYLES, **jugs.STYLES, **bottles.STYLES, **bowls.STYLES}

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Plate, tray, frying pan and dustpan: wide and shallow objects."""

from collections.abc import Callable

from hooc_perception.objects.catalogue import dustpans, pans, plates, trays
from hooc_perception.objects.catalogue.draw import Draw
from manifold3d import Manifold

STYLES: dict[str, tuple[Callable[[Draw], Manifold], ...]] = {
    **plates.STYLES, **trays.STYLES, **pans.STYLES, **dustpans.STYLES}

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What proposing and parsing both derive from one observation, derived once."""

import weakref

from hooc_perception.core.frame.evidence import Evidence
from hooc_perception.core.frame.field import build_field, fuse_cloud
from hooc_perception.core.frame.patches import smooth_patches

_latest = None


class Workspace:
    """
    The fused cloud, its field and the pixels of all views, in three resolutions.

    :ivar cloud: Cloud; `field` Field, None where nothing stands on the table.
    :ivar evidence: Evidence of every pixel; `coarse` of every second row and column, `coarsest`
        of every fourth.
    """

    def __init__(self, observation, probabilities, models):
        """Fuse the views."""
        self.cloud = fuse_cloud(observation, probabilities)
        self.patch = smooth_patches(self.cloud)
        self.field = build_field(observation, self.cloud) if len(self.patch) else None
        self.evidence = Evidence(observation, probabilities, models, self.cloud, self.patch)
        self.coarse = Evidence(observation, probabilities, models, self.cloud, self.patch, 2)
        self.coarsest = Evidence(observation, probabilities, models, self.cloud, self.patch, 4)


def workspace_of(observation, probabilities, models):
    """
    Return the Workspace of an observation; asked again for the same one, the same object.

    Only the latest is remembered, and only for as long as its inputs live.
    """
    global _latest
    key = observation, probabilities
    if _latest is not None and all(ref() is x for ref, x in zip(_latest[0], key)) \
            and _latest[1] is models:
        return _latest[2]
    space = Workspace(observation, probabilities, models)
    _latest = tuple(weakref.ref(x, _forget) for x in key), models, space
    return space


def _forget(_):
    """Drop the memory when an input dies."""
    global _latest
    _latest = None

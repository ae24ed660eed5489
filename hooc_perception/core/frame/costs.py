# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What a pixel and an object cost in the joint energy: parameters of ranking and of parsing."""

from dataclasses import dataclass

from hooc_perception.core.config import Config, param
from hooc_perception.core.frame.kernels.records import PixelWeights


@dataclass(frozen=True)
class PixelCosts(Config):
    """
    Costs of one pixel, in units of an unexplained foreground pixel.

    The ranking of hypotheses, the joint energy and the uncertainty of poses all use them.
    """

    tolerance_m: float = param(0.03, 'Depth residual that costs as much as no explanation.', 'm',
                               0.002, 0.5)
    normal_weight: float = param(0.4, 'Cost of a perpendicular normal.', '', 0.0, 2.0)
    category_weight: float = param(0.4, 'Cost of a category that the classifier rules out.', '',
                                   0.0, 4.0)
    free_weight: float = param(0.7, 'Cost of a free-space violation: a surface was measured '
                               'behind the object.', '', 0.0, 2.0)

    unknown_weight: float = param(0.6, 'Discount on an unexplained pixel where the classifier is '
                                  'certain of something else, a thing of no category: a category '
                                  'that explains it little better is not forced on it.', '', 0.0,
                                  1.0)

    def weights(self) -> PixelWeights:
        """Return the same numbers as the kernels take them."""
        return PixelWeights(self.tolerance_m, self.normal_weight, self.category_weight,
                            self.free_weight)


@dataclass(frozen=True)
class ObjectCosts(Config):
    """Costs of one object of the subset, in pixels of the full images."""

    complexity: float = param(0.1, 'Cost per covered pixel.', '', 0.0, 2.0)
    size_prior: float = param(0.05, 'Cost of the squared log scale, per covered pixel.', '', 0,
                              2.0)
    base_cost: float = param(40.0, 'Cost of an object that no verifier has judged.', 'px', 0.0,
                             1000.0)
    overlap: float = param(300.0, 'Cost of an object that lies inside others.', 'px', 0.0, 1e5)

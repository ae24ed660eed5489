# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""How far the surfaces disagree that two cameras both see: the health of their poses."""

from collections.abc import Sequence
from dataclasses import dataclass

from hooc_perception.core.arrays import Float64Array
from hooc_perception.core.extrinsics.solve import moved, Normal, open_motions
from hooc_perception.core.extrinsics.surface import Matches, matches, Surface, surface_of
from hooc_perception.core.types import Observation
import numpy as np

# Distances within which a point looks for the other surface, from coarse to fine, metres.
REACHES_M = (0.06, 0.03, 0.015, 0.01, 0.01)
STEPS_PER_REACH = 4
# Smaller steps end the work with a reach, metres and radians.
LEAST_STEP = 5e-5
# Fewer common points than this say nothing.
FEWEST_POINTS = 200
# A point agrees with a surface that is nearer than this; of two that match, most do.
AGREE_M, LEAST_AGREEMENT = 0.01, 0.5
# What two healthy cameras stay below.
SHIFTED_M, TURNED_DEG = 0.01, 1.0


@dataclass(frozen=True)
class PairResidual:
    """
    The disagreement of two cameras about the surfaces that both see.

    :ivar names: of the two cameras.
    :ivar shift_m: how far the second camera's surfaces have to move onto the first one's, in
        their middle; NaN = not measured.
    :ivar turn_deg: how far they have to turn; NaN = not measured.
    :ivar surface_m: median distance of the common points from the other surface as the poses
        are, NaN = not measured.
    :ivar agreement: share of the points that the other camera can see, that agree with it within
        AGREE_M once moved; NaN where there is none.
    :ivar points: number of common points.
    :ivar place_known: whether the common surfaces determine position and heading on the table.
        Where they are level, shift and turn are those of height and tilt alone.
    """

    names: tuple[str, str]
    shift_m: float
    turn_deg: float
    surface_m: float
    agreement: float
    points: int
    place_known: bool

    @property
    def measured(self) -> bool:
        """Return whether shift and turn are known."""
        return bool(np.isfinite(self.shift_m))

    @property
    def trouble(self) -> str | None:
        """Return one sentence that says what is wrong and how to fix it, None if nothing is."""
        a, b = self.names
        if np.isfinite(self.agreement) and self.agreement < LEAST_AGREEMENT:
            return (f'only {self.agreement:.0%} of the surface that {a} and {b} should both see '
                    'matches, so their poses are off by more than can be measured or one of them '
                    'has moved; run hooc calibrate')
        if not (self.shift_m > SHIFTED_M or self.turn_deg > TURNED_DEG):
            return None
        return (f'the surfaces that {a} and {b} both see disagree by {1000 * self.shift_m:.0f} mm '
                f'and {self.turn_deg:.1f} degrees, so objects appear twice or blurred; run hooc '
                'calibrate')

    def __str__(self) -> str:
        """Return the figures as text; what was not measured is said to be so."""
        if not self.measured:
            return f'not measured ({self.points} common points)'
        text = f'{1000 * self.shift_m:.1f} mm, {self.turn_deg:.2f} degrees'
        return text if self.place_known else f'{text} (height and tilt only)'


def pair_residuals(observation: Observation) -> list[PairResidual]:
    """Return the PairResidual of each pair of an Observation's views that hold readings."""
    views = [view for view in observation.views if np.isfinite(view.depth).any()]
    surfaces = [surface_of(view) for view in views]
    return [pair_residual((a.camera.name, b.camera.name), [(surfaces[i], surfaces[j])],
                          a.camera.T_world_camera, b.camera.T_world_camera)
            for i, a in enumerate(views) for j, b in enumerate(views) if i < j]


def pair_residual(names: tuple[str, str], scenes: Sequence[tuple[Surface, Surface]],
                  T_world_a: Float64Array, T_world_b: Float64Array,
                  start: Float64Array | None = None) -> PairResidual:
    """
    Return the disagreement of two fixed cameras over one or more scenes.

    The second camera is registered to the first by point-to-plane distances, from coarse to
    fine; the motion that this takes is the residual.

    :param scenes: the Surfaces of both cameras, per scene.
    :param start: pose (4, 4) of the second camera to start from, where a better one is known.
    """
    T = T_world_b if start is None else start
    now = _both_ways(scenes, T_world_a, T_world_b, REACHES_M[1])
    surface_m = _median(now)
    for reach in REACHES_M:
        for _ in range(STEPS_PER_REACH):
            found = _both_ways(scenes, T_world_a, T, reach)
            if sum(len(m.points) for _, _, m in found) < FEWEST_POINTS:
                break
            known = not len(open_motions(2, found))
            twist = _step(found, np.stack([T_world_a[:3, 3], T[:3, 3]]), known)
            T = moved(T, twist)
            if np.abs(twist).max() < LEAST_STEP:
                break
    found = _both_ways(scenes, T_world_a, T, AGREE_M)
    points = sum(len(m.points) for _, _, m in found)
    comparable = sum(m.comparable for _, _, m in found)
    agreement = points / comparable if comparable >= FEWEST_POINTS else np.nan
    known = not len(open_motions(2, found))
    if points < FEWEST_POINTS or agreement < LEAST_AGREEMENT:
        return PairResidual(names, np.nan, np.nan, surface_m, float(agreement), points, known)
    shift, turn = _motion(T @ np.linalg.inv(T_world_b), found)
    return PairResidual(names, shift, turn, surface_m, float(agreement), points, known)


def _both_ways(scenes: Sequence[tuple[Surface, Surface]], T_world_a: Float64Array,
               T_world_b: Float64Array, reach_m: float) -> list[tuple[int, int, Matches]]:
    """Return (camera of the points, camera of the surface, Matches) of all scenes."""
    found = []
    for a, b in scenes:
        found.append((1, 0, matches(a, T_world_a, b, T_world_b, reach_m)))
        found.append((0, 1, matches(b, T_world_b, a, T_world_a, reach_m)))
    return found


def _step(found: Sequence[tuple[int, int, Matches]], centres: Float64Array,
          known: bool) -> Float64Array:
    """Return the twist (6,) of the second camera; height and tilt alone if that is all."""
    normal = Normal(centres)
    for i, j, m in found:
        normal.add(m.points, m.normals, m.distance_m, i, j)
    free = np.zeros((2, 6), bool)
    free[1] = True if known else [False, False, True, True, True, False]
    return normal.step(free)[1]


def _motion(T_after_before: Float64Array,
            found: Sequence[tuple[int, int, Matches]]) -> tuple[float, float]:
    """Return (shift of the middle of the common points in metres, turn in degrees)."""
    middle = np.concatenate([m.points for _, _, m in found]).mean(axis=0)
    shift = T_after_before[:3, :3] @ middle + T_after_before[:3, 3] - middle
    cosine = (np.trace(T_after_before[:3, :3]) - 1) / 2
    return float(np.linalg.norm(shift)), float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))


def _median(found: Sequence[tuple[int, int, Matches]]) -> float:
    """Return the median distance of the matched points, NaN if there are too few."""
    distance = np.concatenate([m.distance_m for _, _, m in found])
    return float(np.median(np.abs(distance))) if len(distance) >= FEWEST_POINTS else float('nan')

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Poses of fixed cameras from the scenes that they see, with held-out figures.

Three steps: every camera is levelled on the table; place and heading are searched for on height
maps; all poses are refined together. The figures "after" come from scenes that the poses were
not fitted to: two refinements, each on one half of the scenes, are measured on the other half.
(The search, which only says which object is which, reads all of them.)
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from hooc_perception.core.arrays import Float64Array
from hooc_perception.core.extrinsics.coarse import place
from hooc_perception.core.extrinsics.joint import pair_matches, refine, table_points
from hooc_perception.core.extrinsics.residual import (
    AGREE_M,
    LEAST_AGREEMENT,
    pair_residual,
    PairResidual,
    SHIFTED_M,
    TURNED_DEG,
)
from hooc_perception.core.extrinsics.solve import open_motions
from hooc_perception.core.extrinsics.surface import Surface, surface_of
from hooc_perception.core.extrinsics.table import levelled
from hooc_perception.core.geometry import inverse
from hooc_perception.core.segment.level import fitted_plane
from hooc_perception.core.segment.observe import observe
from hooc_perception.core.segment.rectify import rectify
from hooc_perception.core.types import Camera, DepthView, RectifiedView
from hooc_perception.errors import HoocError
import numpy as np

# Fewer readings of the table than this say nothing about it.
FEWEST_TABLE_POINTS = 200


@dataclass(frozen=True)
class Offset:
    """A distance in millimetres and an angle in degrees; NaN = not measured."""

    mm: float
    deg: float

    def __str__(self) -> str:
        """Return the figures as text."""
        if not np.isfinite(self.mm):
            return 'not measured'
        return f'{self.mm:.1f} mm, {self.deg:.2f} deg'


@dataclass(frozen=True)
class CameraFigures:
    """
    What calibration did to one camera.

    :ivar moved: from its old pose to its new one.
    :ivar table_before, table_after: height and tilt of the table that it measures; the latter on
        held-out scenes where `held_out` of the Calibration is True.
    :ivar spread: difference of the poses, relative to the first camera, that the two halves of
        the scenes give; NaN for the first camera and where there are no halves.
    """

    name: str
    moved: Offset
    table_before: Offset
    table_after: Offset
    spread: Offset


@dataclass(frozen=True)
class Calibration:
    """
    Refined poses and their figures.

    :ivar before, cameras: the cameras as they were and with refined poses, fitted to all scenes.
    :ivar figures: per camera.
    :ivar pairs: per pair of cameras, the PairResidual before and after.
    :ivar scenes: number of frame sets.
    :ivar held_out: whether the figures after are of scenes that the poses were not fitted to.
    """

    before: tuple[Camera, ...]
    cameras: tuple[Camera, ...]
    figures: tuple[CameraFigures, ...]
    pairs: tuple[tuple[PairResidual, PairResidual], ...]
    scenes: int
    held_out: bool


def calibrate(scenes: Iterable[Sequence[DepthView]],
              groups: Sequence[int] | None = None) -> Calibration:
    """
    Return the Calibration of fixed cameras.

    The table fixes height, roll and pitch of every camera; x, y and heading of the first one
    stay as they are. A single camera is only levelled. The same scenes give the same poses.

    :param scenes: per frame set one DepthView per camera, the same cameras at the same poses
        throughout; read once, one by one.
    :param groups: per frame set a number; frame sets of the same number are held out together,
        such as those of one bag. None = each stands for itself.
    :raises HoocError: where a camera sees no table, or the scenes do not determine the poses.
    """
    rectified: list[list[RectifiedView]] = []
    before: tuple[Camera, ...] = ()
    for scene in scenes:
        before = before or tuple(view.camera for view in scene)
        rectified.append([rectify(view) for view in scene])
    if not rectified:
        raise HoocError('there is no frame set to calibrate from; give at least one scene')
    level = [levelled([scene[i] for scene in rectified]) for i in range(len(before))]
    surfaces = [_surfaces(scene, level) for scene in rectified]
    start = place(surfaces, [camera.T_world_camera for camera in level])
    names = [camera.name for camera in before]
    poses = _fit(surfaces, start, names)
    groups = list(range(len(surfaces))) if groups is None else list(groups)
    halves = _halves(surfaces, groups, start, names)
    tests = halves or [(poses, surfaces)]
    spreads = _spreads(halves, len(before))
    pairs = tuple(_pair(names, i, j, [c.T_world_camera for c in before], poses, surfaces, tests)
                  for i in range(len(before)) for j in range(i + 1, len(before)))
    for _, after in pairs:
        if after.agreement < LEAST_AGREEMENT and len(tests) < 2:
            raise HoocError(f'the surfaces of {" and ".join(after.names)} do not match after '
                            f'registration (only {after.agreement:.0%} agree), so nothing is '
                            'written; start from poses that are right to 5 degrees and 5 cm')
    figures = tuple(CameraFigures(name, _offset(camera.T_world_camera, T),
                                  _table_offset(camera.T_world_camera, T),
                                  _table_after(i, tests), spread)
                    for i, (name, camera, T, spread) in enumerate(
                        zip(names, before, poses, spreads)))
    cameras = tuple(replace(camera, T_world_camera=T) for camera, T in zip(before, poses))
    return Calibration(before, cameras, figures, pairs, len(surfaces), bool(halves))


def _surfaces(scene: Sequence[RectifiedView], level: Sequence[Camera]) -> list[Surface]:
    """Return the Surface of each view of a frame set, seen with levelled cameras."""
    views = [replace(view, camera=camera) for view, camera in zip(scene, level)]
    return [surface_of(view) for view in observe(views).views]


def _fit(surfaces: Sequence[Sequence[Surface]], start: Sequence[Float64Array],
         names: Sequence[str]) -> list[Float64Array]:
    """Return the poses fitted to some frame sets; raise HoocError where they leave one open."""
    poses = refine(surfaces, start)
    motions = open_motions(len(poses), pair_matches(surfaces, poses, AGREE_M))
    if len(motions):
        raise HoocError(_open_text(motions, names))
    return poses


def _open_text(motions: Float64Array, names: Sequence[str]) -> str:
    """Return one sentence that names the motions that nothing fixes, and the fix."""
    by_camera: dict[str, list[str]] = {}
    for motion in motions:
        camera = int(np.argmax(np.linalg.norm(motion, axis=1)))
        x, y, turn = motion[camera]
        if abs(turn) > np.hypot(x, y):
            text = 'its heading (turning about the vertical axis)'
        elif abs(x) > 3 * abs(y) or abs(y) > 3 * abs(x):
            text = f'its position along {"x" if abs(x) > abs(y) else "y"}'
        else:
            text = f'its position along the direction ({x:.1f}, {y:.1f}) of the table'
        by_camera.setdefault(names[camera], []).append(text)
    what = '; of '.join(f'{name}, {" and ".join(dict.fromkeys(texts))}'
                        for name, texts in by_camera.items())
    return (f'the scenes do not determine all poses: of {what} cannot be observed, so nothing is '
            'written; put five or more objects with upright sides, boxes among them, where all '
            'cameras see them, and record several arrangements')


def _halves(surfaces: Sequence[Sequence[Surface]], groups: Sequence[int],
            start: Sequence[Float64Array], names: Sequence[str],
            ) -> list[tuple[list[Float64Array], list[Sequence[Surface]]]]:
    """Return two times (poses fitted to one half, the other half); [] where that is impossible."""
    order = {group: k for k, group in enumerate(dict.fromkeys(groups))}
    if len(order) < 2:
        order = {}
    even = [order.get(group, k) % 2 == 0 for k, group in enumerate(groups)]
    parts = [[s for s, is_even in zip(surfaces, even) if is_even == wanted]
             for wanted in (True, False)]
    if not all(parts):
        return []
    try:
        return [(_fit(fitted, start, names), list(held))
                for fitted, held in (parts, parts[::-1])]
    except HoocError:
        return []       # Only all scenes together determine the poses.


def _spreads(halves: Sequence[tuple[list[Float64Array], object]], count: int) -> list[Offset]:
    """Return per camera the difference of the two fits; raise HoocError where it is too large."""
    unknown = [Offset(float('nan'), float('nan'))] * count
    if not halves:
        return unknown
    (a, _), (b, _) = halves
    spreads = unknown[:1] + [_offset(inverse(a[0]) @ a[i], inverse(b[0]) @ b[i])
                             for i in range(1, count)]
    worst = max(spreads[1:], key=lambda s: s.mm, default=unknown[0])
    if worst.mm > 1000 * SHIFTED_M or any(s.deg > TURNED_DEG for s in spreads):
        raise HoocError(f'two halves of the scenes give poses that differ by {worst}, so neither '
                        'is believed and nothing is written; record more scenes with more objects '
                        'that all cameras see, and check that no camera moved in between')
    return spreads


def _pair(names: Sequence[str], i: int, j: int, before: Sequence[Float64Array],
          poses: Sequence[Float64Array], surfaces: Sequence[Sequence[Surface]],
          tests: Sequence[tuple[Sequence[Float64Array], Sequence[Sequence[Surface]]]],
          ) -> tuple[PairResidual, PairResidual]:
    """Return the PairResidual before, and the worse one of the tests after."""
    pair = names[i], names[j]
    # The refined poses are the better start to measure how far the old ones are off.
    start = before[i] @ inverse(poses[i]) @ poses[j]
    old = pair_residual(pair, [(s[i], s[j]) for s in surfaces], before[i], before[j], start)
    new = [pair_residual(pair, [(s[i], s[j]) for s in held], T[i], T[j]) for T, held in tests]
    return old, max(new, key=lambda residual: (residual.measured, residual.shift_m))


def _table_after(i: int, tests: Sequence[tuple[Sequence[Float64Array],
                                               Sequence[Sequence[Surface]]]]) -> Offset:
    """Return the worse height and tilt of the table that a camera measures in the tests."""
    offsets = []
    for poses, held in tests:
        points = table_points([scene[i] for scene in held], poses[i])
        fit = fitted_plane(points, 0.01) if len(points) >= FEWEST_TABLE_POINTS else None
        if fit is not None:
            a, b, c = fit[0]
            middle = points[:, :2].mean(axis=0)
            offsets.append(Offset(1000 * float(abs(c + a * middle[0] + b * middle[1])),
                                  float(np.degrees(np.arctan(np.hypot(a, b))))))
    return max(offsets, key=lambda o: o.mm, default=Offset(float('nan'), float('nan')))


def _offset(T_a: Float64Array, T_b: Float64Array) -> Offset:
    """Return distance and angle between two poses (4, 4)."""
    D = inverse(T_a) @ T_b
    cosine = np.clip((np.trace(D[:3, :3]) - 1) / 2, -1, 1)
    return Offset(1000 * float(np.linalg.norm(D[:3, 3])), float(np.degrees(np.arccos(cosine))))


def _table_offset(T_before: Float64Array, T_after: Float64Array) -> Offset:
    """Return height and tilt, with the old pose, of the table that lies at z = 0 with the new."""
    T = T_before @ inverse(T_after)
    return Offset(1000 * float(abs(T[2, 3])),
                  float(np.degrees(np.arccos(np.clip(T[2, 2], -1, 1)))))

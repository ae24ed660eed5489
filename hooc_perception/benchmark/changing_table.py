# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Tables of soak tests: a rendered one that changes, and a recorded one that does not."""

from collections.abc import Sequence
from dataclasses import dataclass

from hooc_perception.benchmark.live import NOISE_M
from hooc_perception.core.arrays import Float32Array, Float64Array, Int32Array
from hooc_perception.core.geometry import posed_vertices
from hooc_perception.core.render import render_depth
from hooc_perception.core.types import Camera, DepthView, GenericModel
from hooc_perception.errors import HoocError
from hooc_perception.io.bags.reader import BagScene
from hooc_perception.synthesis.rigs import undistorted
from hooc_perception.synthesis.room import draw_room
import numpy as np
from scipy.spatial.transform import Rotation

# Objects that a model of any kind finds: none of their sides is shorter or longer. [m]
SHORTEST_M, LONGEST_M = 0.05, 0.26
# Places on the table, so far apart that objects do not touch. [m]
APART_M, PLACES = 0.27, 3
FEWEST, MOST, MOST_ALIKE = 3, 6, 2


@dataclass(frozen=True)
class Thing:
    """
    An object on the table.

    :ivar place: number of its place; `translation` (3,) float64 centre, world, metres.
    """

    category: int
    place: int
    translation: Float64Array
    mesh: tuple[Float64Array, Int32Array]


@dataclass(frozen=True)
class Change:
    """
    What happened to one object.

    :ivar kind: `put`, `taken` or `moved`; `name` of the object, a number of its own.
    :ivar before, after: (3,) float64 where it was and is, metres; None = not on the table.
    """

    kind: str
    name: int
    before: Float64Array | None
    after: Float64Array | None


class ChangingTable:
    """
    A rendered table in a room, seen by cameras that stand still.

    :param models: class id c is models[c - 1]; the generic meshes stand on the table.
    :param cameras: with poses; lens distortion is ignored.
    :ivar frame: name of the world frame, that of the table.
    :ivar things: {name: Thing} on the table now.
    :raises HoocError: if no model has a fitting size, or there are no cameras.
    """

    frame = 'table'

    def __init__(self, models: Sequence[GenericModel], cameras: Sequence[Camera],
                 rng: np.random.Generator) -> None:
        if not cameras:
            raise HoocError('the model names no cameras, from which a table could be rendered; '
                            'train it on a set with cameras')
        self._models, self._rng = models, rng
        self._fitting = [c for c, model in enumerate(models, 1) if (
            model.extents.min() >= SHORTEST_M and model.extents.max() <= LONGEST_M)]
        if 2 * len(self._fitting) < MOST:
            raise HoocError(f'fewer than {MOST // 2} categories of the model are between '
                            f'{SHORTEST_M:g} and {LONGEST_M:g} m long on all sides')
        self.cameras = tuple(undistorted(camera) for camera in cameras)
        self._room = draw_room(rng).meshes()
        self._number = 0
        self.things: dict[int, Thing] = {}
        self._depth: list[Float32Array] = []
        while len(self.things) < FEWEST:
            self._put()
        self._render()

    def places(self) -> dict[int, Float64Array]:
        """Return {name: (3,) centre} of the objects on the table now."""
        return {name: thing.translation for name, thing in self.things.items()}

    def change(self) -> Change:
        """Put, take or move one object; return what happened."""
        kinds = ['moved'] + ['put'] * (len(self.things) < MOST) + [
            'taken'] * (len(self.things) > FEWEST)
        kind = str(self._rng.choice(kinds))
        if kind == 'put':
            name = self._put()
            change = Change(kind, name, None, self.things[name].translation)
        else:
            name = int(self._rng.choice(list(self.things)))
            before = self.things[name]
            if kind == 'moved':
                self.things[name] = self._placed(before.category)
                change = Change(kind, name, before.translation, self.things[name].translation)
            else:
                del self.things[name]
                change = Change(kind, name, before.translation, None)
        self._render()
        return change

    def views(self) -> tuple[DepthView, ...]:
        """Return what the cameras see now, with new noise."""
        return tuple(DepthView(camera, (depth + NOISE_M * depth ** 2 * self._rng.standard_normal(
            depth.shape)).astype(np.float32)) for camera, depth in zip(self.cameras, self._depth))

    def _put(self) -> int:
        """Put one more object down; return its name."""
        there = [thing.category for thing in self.things.values()]
        few = [c for c in self._fitting if there.count(c) < MOST_ALIKE]
        self._number += 1
        self.things[self._number] = self._placed(int(self._rng.choice(few)))
        return self._number

    def _placed(self, category: int) -> Thing:
        """Return an object, upright, in a free place."""
        taken = {thing.place for thing in self.things.values()}
        place = int(self._rng.choice([k for k in range(PLACES ** 2) if k not in taken]))
        model = self._models[category - 1]
        x, y = (APART_M * (np.array(divmod(place, PLACES)) - (PLACES - 1) / 2)
                + self._rng.uniform(-0.01, 0.01, 2))
        translation = np.array([x, y, model.extents[2] / 2])
        turn = Rotation.from_euler('z', self._rng.uniform(-np.pi, np.pi)).as_quat()
        return Thing(category, place, translation, (
            posed_vertices(model, translation, turn, model.extents), model.faces))

    def _render(self) -> None:
        """Render the depth of all cameras without noise, NaN where nothing is."""
        meshes = [thing.mesh for thing in self.things.values()] + self._room
        self._depth = []
        for camera in self.cameras:
            depth, _ = render_depth(meshes, camera)
            depth[~np.isfinite(depth)] = np.nan
            self._depth.append(depth)


class RecordedTable:
    """
    The first frame set of a bag, with the interface of a ChangingTable.

    :ivar cameras: as the bag has them; `frame` the name of its world frame.
    """

    def __init__(self, scene: BagScene) -> None:
        self._views, self.frame = scene.views(), scene.info['world_frame'] or 'table'
        self.cameras = tuple(view.camera for view in self._views)

    def views(self) -> tuple[DepthView, ...]:
        """Return the same views again."""
        return self._views

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Frame sets of fixed cameras in scene sets and bags."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from hooc_perception.core.arrays import Float64Array
from hooc_perception.core.geometry import inverse
from hooc_perception.core.segment.checks import same_calibration
from hooc_perception.core.types import Camera, DepthView
from hooc_perception.errors import HoocError
from hooc_perception.io.bags.reader import BagScene
from hooc_perception.io.scenes.scene import RecordedScene
from hooc_perception.io.scenes.scene_set import SceneSet
import numpy as np


@dataclass(frozen=True, eq=False)
class Recording:
    """
    What a rig of fixed cameras has recorded.

    :ivar cameras: as stated; poses in the frame of the table.
    :ivar frame: name of the frame of the poses in the files, `table` where it is the table's.
    :ivar T_frame_table: (4, 4) from the table frame to that one; the identity where they are one.
    :ivar frames: per frame set, where it comes from and which one it is.
    :ivar groups: per frame set a number, the same for those of one bag or one scene.
    :ivar left_out: one sentence on what is not used, None where all is.
    """

    cameras: tuple[Camera, ...]
    frame: str
    T_frame_table: Float64Array
    frames: tuple[tuple[RecordedScene | BagScene, dict[str, int] | None], ...]
    groups: tuple[int, ...]
    left_out: str | None = None

    def in_frame(self, cameras: Sequence[Camera]) -> tuple[Camera, ...]:
        """Return cameras, posed in the table frame, with poses in the frame of the files."""
        if np.array_equal(self.T_frame_table, np.eye(4)):
            return tuple(cameras)
        return tuple(replace(camera, T_world_camera=self.T_frame_table @ camera.T_world_camera)
                     for camera in cameras)

    def read(self) -> Iterator[tuple[DepthView, ...]]:
        """Yield the DepthViews of each frame set, all with the same cameras."""
        for scene, images in self.frames:
            views = (scene.views(images) if isinstance(scene, BagScene) and images
                     else scene.source_views())
            yield tuple(replace(view, camera=camera)
                        for view, camera in zip(views, self.cameras))


def of_set(scene_set: SceneSet) -> Recording:
    """
    Return the Recording of a scene set: the scenes in which the cameras stand as in most.

    :raises HoocError: where the cameras stand elsewhere in every scene.
    """
    rigs: list[tuple[Camera, ...]] = []
    rig_of = []
    for scene in scene_set.scenes:
        known = next((k for k, rig in enumerate(rigs) if _same(rig, scene.source_cameras)), None)
        if known is None:
            known = len(rigs)
            rigs.append(scene.source_cameras)
        rig_of.append(known)
    (most, count), = Counter(rig_of).most_common(1)
    if count == 1 and len(rig_of) > 1:
        raise HoocError(f'{scene_set.path}: the cameras stand elsewhere in every scene, so they '
                        'are not fixed; choose one scene with --scene')
    used = [scene for scene, rig in zip(scene_set.scenes, rig_of) if rig == most]
    left_out = (f'{len(rig_of) - count} of {len(rig_of)} scenes are left out, because the cameras '
                'stand elsewhere there' if count < len(rig_of) else None)
    frame = scene_set.world_frame if used[0].table is None else 'world'
    return Recording(used[0].cameras, frame, _T_frame_table(used[0]),
                     tuple((scene, None) for scene in used), tuple(range(count)), left_out)


def of_bags(paths: Sequence[Path], frames: int) -> Recording:
    """
    Return the Recording of bags of the same rig.

    :param frames: frame sets to take from each bag, evenly spread over it.
    :raises HoocError: where a bag cannot be read, or its cameras are not those of the first.
    """
    bags = [BagScene(path) for path in paths]
    for bag in bags[1:]:
        if not _same(bags[0].source_cameras, bag.source_cameras):
            raise HoocError(f'{bag.path}: the cameras or their poses are not those of '
                            f'{bags[0].path}, so they are not one fixed rig; calibrate each bag '
                            'on its own')
    taken, groups = [], []
    for group, bag in enumerate(bags):
        counts = {name: bag.topics[topic].count for name, topic in bag.depth_topics.items()}
        number = min(frames, *counts.values())
        for k in range(number):
            share = k / max(number - 1, 1)
            # An image that cannot be used is replaced by a later one, hence not the very last.
            taken.append((bag, {name: int(share * max(count - 2, 0))
                                for name, count in counts.items()}))
            groups.append(group)
    return Recording(bags[0].cameras, bags[0].world_frame, _T_frame_table(bags[0]), tuple(taken),
                     tuple(groups))


def _T_frame_table(scene: RecordedScene | BagScene) -> Float64Array:
    """Return the pose (4, 4) of the table frame in the frame of the files."""
    return np.eye(4) if scene.table is None else inverse(scene.table.T_table_source)


def _same(a: Sequence[Camera], b: Sequence[Camera]) -> bool:
    """Return whether two rigs are the same cameras at the same poses."""
    return [c.name for c in a] == [c.name for c in b] and all(
        same_calibration(x, y) for x, y in zip(a, b))

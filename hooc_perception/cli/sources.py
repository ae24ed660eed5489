# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What `hooc parse` reads: a scene set, a BOP dataset, or a bag."""

from dataclasses import dataclass, replace
from pathlib import Path

from hooc_perception.errors import HoocError
from hooc_perception.io.bags.folder import is_bag
from hooc_perception.io.bags.reader import BagScene
from hooc_perception.io.bags.sequences import frame_sets, recorded_sequence
from hooc_perception.io.scenes.scene_set import load_scene_set, SceneSet
from hooc_perception.io.scenes.sequences import (
    RecordedSequence,
    scenes_named,
    whole_sequences,
)
from hooc_perception.trained.folder import ModelFolder


@dataclass(frozen=True, eq=False)
class BagSet:
    """
    The scenes of a bag, with those fields of a SceneSet that parsing reads.

    :ivar category_names: what the bag says may stand in its scene; empty where it says nothing.
    :ivar max_instances: objects of one category that the scene may hold, 0 = no limit.
    :ivar scenes: the frame sets of the sequence that the bag holds; of other bags, the first one.
    :ivar sequences: the one that the bag holds, if it does.
    """

    path: Path
    name: str
    category_names: tuple[str, ...]
    max_instances: int
    scenes: tuple[BagScene, ...]
    sequences: tuple[RecordedSequence, ...] = ()

    def selected(self, names: list[str] | None) -> 'BagSet':
        """Return a set of these scenes, as `SceneSet.selected` does."""
        if not names:
            return self
        names = scenes_named(names, self.sequences)
        known = {scene.name: scene for scene in self.scenes}
        for name in names:
            if name not in known:
                raise HoocError(f'{self.path}: there is no scene {name!r}; the bag holds '
                                f'{", ".join([*known][:20])}')
        return replace(self, scenes=tuple(known[name] for name in names),
                       sequences=whole_sequences(self.sequences, names))


def load_source(path: str | Path, model: ModelFolder) -> SceneSet | BagSet:
    """
    Return what a path names: a scene set, a BOP dataset or a bag.

    :param model: says how many objects of one category may be there, and which categories, where
        a bag does not.
    :raises HoocError: where it cannot be read.
    """
    path = Path(path)
    if not is_bag(path):
        return load_scene_set(path)
    bag = BagScene(path)
    limit = bag.info['max_instances']
    names = bag.info['categories'] or [generic.name for generic in model.models]
    return BagSet(path, bag.info['dataset'], tuple(names),
                  limit if limit >= 0 else model.max_instances, frame_sets(bag) or (bag,),
                  (sequence,) if (sequence := recorded_sequence(bag)) else ())


def provenance(source: SceneSet | BagSet, model: str | Path,
               out: str | Path) -> tuple[dict[str, str], dict[str, str]]:
    """
    Return what a results file says of its source, so that `hooc report` finds the images.

    :param model: the model folder; `out`: the results file, which the paths are relative to.
    :return: entries of the whole file, entries of each scene.
    """
    from hooc_perception.cli.places import relative_place
    if isinstance(source, BagSet):
        return {'model': relative_place(model, out)}, {'bag': relative_place(source.path, out)}
    return {'set': relative_place(source.path, out)}, {}

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What the commands that compare results with the ground truth share."""

from collections.abc import Sequence
from pathlib import Path
import sys
from typing import Any, TYPE_CHECKING

from hooc_perception.errors import HoocError

if TYPE_CHECKING:
    from hooc_perception.evaluation.tables import Table
    from hooc_perception.io.scenes.scene_set import SceneSet


def load_matching(path: str | Path, scene_set: 'SceneSet') -> dict[str, Any]:
    """
    Return the content of a results file; warn of scenes that the set does not hold.

    :param scene_set: the whole set: a scene that was not selected is no reason for a warning.
    :raises HoocError: where file and set have no scene in common.
    """
    from hooc_perception.io.scenes.results import load_results, scenes_in_common
    content = load_results(path)
    known = {scene.name for scene in scene_set.scenes}
    warn_of_others(path, scenes_in_common(content, known, path, scene_set.path)[1],
                   scene_set.path)
    if content['dataset'] != scene_set.name:
        print(f'[WARN] {path} is of the dataset {content["dataset"]!r}, {scene_set.path} is '
              f'{scene_set.name!r}', file=sys.stderr)
    return content


def warn_of_others(path: str | Path, others: str, place: str | Path) -> None:
    """Print which scenes of a results file are not in a set; nothing where all of them are."""
    if others:
        print(f'[WARN] {path}: {others} not in {place} and left out', file=sys.stderr)


def print_tables(tables: Sequence['Table'], markdown: str | None = None,
                 details: Sequence['Table'] = ()) -> None:
    """
    Print tables and, if requested, write them as Markdown.

    :param markdown: file to write; None = none.
    :param details: tables for that file alone, after the others.
    """
    from hooc_perception.evaluation.tables import to_markdown, to_text
    from hooc_perception.io.scenes.files import write_atomically
    print('\n\n'.join(to_text(table) for table in tables))
    if markdown:
        write_atomically(markdown, '\n'.join(map(to_markdown, (*tables, *details))))


def write_json(path: str | Path | None, content: Any) -> None:
    """Write plain data as JSON; no path = nothing."""
    import json

    from hooc_perception.io.scenes.files import write_atomically
    if path:
        write_atomically(path, json.dumps(content, indent=1, allow_nan=False) + '\n')


def require_poses(scene_set: 'SceneSet', command: str) -> None:
    """Raise HoocError where no scene of a set has true poses."""
    if not any(scene.truth for scene in scene_set.scenes):
        raise HoocError(f'{scene_set.path}: no scene has true poses; hooc {command} needs a set '
                        'with annotated scenes')

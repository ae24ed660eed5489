# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Read the results that a recording of the nodes holds beside the images they are of."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
import json
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

from hooc_perception.core.arrays import Float64Array
from hooc_perception.core.geometry import inverse
from hooc_perception.errors import HoocError
from hooc_perception.io.bags.contents import TABLE_FRAME
from hooc_perception.io.bags.files import iter_messages, topics
from hooc_perception.io.bags.images import read_image
from hooc_perception.io.bags.reader import BagScene
from hooc_perception.io.scenes import fields
from hooc_perception.io.scenes.results import checked_events, LAST_STAMP_NS
from hooc_perception.ros.messages.conversions import nanoseconds
from hooc_perception.supervisor.answers import (
    frame_set_result,
    FrameSetResult,
    images_of,
    OBJECT_PARTS,
)

POSES, LABELS, EVENTS = 'objects/poses', 'objects/labels', 'objects/events'
NEEDED = (POSES, 'objects/attributes')


@dataclass(frozen=True)
class RecordedResults:
    """
    The results of a recording.

    :ivar bag: its images.
    :ivar results: in the order of their stamps and the frame of the table; those without
        recorded images are left out.
    :ivar events: {stamp in ns: what happened before that result}, None where the recording
        lacks `objects/events`.
    :ivar model: folder of the meshes that `objects/labels` names, None where it names none.
    """

    bag: BagScene
    results: list[FrameSetResult]
    events: dict[int, list[dict[str, Any]]] | None
    model: Path | None


def recorded_results(path: Path) -> RecordedResults:
    """
    Return the results of a recording: of `hooc run --record`, or of `ros2 bag record`.

    :raises HoocError: if it holds none, or they cannot be read.
    """
    known = topics(path)
    place = _namespace(path, known)
    names = {topic: f'{place}{topic}' for topic in (*OBJECT_PARTS, LABELS, EVENTS)}
    # By topic and stamp.
    parts: dict[str, dict[int, Any]] = {topic: {} for topic in names}
    written, frame, labels = {}, '', {}
    topic_of = {name: topic for topic, name in names.items()}
    for message in iter_messages(path, topic_of.keys() & known.keys()):
        topic, content = topic_of[message.topic.name], message.read(path)
        where = f'{path}: {message.topic.name}'
        if topic == LABELS:
            labels = _json(content.data, where)
            continue
        if topic in (EVENTS, 'scene/summary'):
            told = _json(content.data, where)
            stamp = fields.integer(fields.required(told, 'stamp_ns', where), 0, LAST_STAMP_NS,
                                   f'{where} stamp_ns')
            parts[topic][stamp] = told
            continue
        stamp = nanoseconds(content.header.stamp)
        parts[topic][stamp] = content
        if topic == POSES:
            written[stamp], frame = message.time_ns, content.header.frame_id
    bag = BagScene(path)
    T_table_frame = _table_from(frame, bag)
    images = _images(bag)
    results = [_result(path, stamp, parts, images, written[stamp]).moved(T_table_frame)
               for stamp in sorted(parts[POSES].keys() & parts[NEEDED[1]].keys())
               if _recorded(stamp, images)]
    if not results:
        raise HoocError(f'{path}: no result belongs to recorded images; record the depth images '
                        f'and {place}objects/* together')
    events = None
    if names[EVENTS] in known:
        events = {stamp: checked_events(content.get('events'), f'{path}: {names[EVENTS]}')
                  for stamp, content in parts[EVENTS].items()}
    return RecordedResults(bag, results, events, _model_folder(labels))


def _namespace(path: Path, known: Collection[str]) -> str:
    """Return what stands before the topics of the parsing node."""
    found = [name.removesuffix(POSES) for name in known if name.endswith(f'/{POSES}')]
    found = [place for place in found if all(f'{place}{topic}' in known for topic in NEEDED)]
    if not found:
        raise HoocError(f'{path}: it holds no results ({" and ".join(NEEDED)}); record them, or '
                        'parse the bag with hooc parse or hooc run')
    if found[1:]:
        raise HoocError(f'{path}: it holds the results of several chains ({", ".join(found)}); '
                        'record one of them')
    return found[0]


def _json(text: str, where: str) -> dict[str, Any]:
    """Return the mapping of a JSON message."""
    try:
        return fields.mapping(json.loads(text), where)
    except (ValueError, RecursionError):
        raise HoocError(f'{where} is not valid JSON; record it again') from None


def _table_from(frame: str, bag: BagScene) -> Float64Array | None:
    """Return T_table_frame (4, 4) of the frame of results, None where both are the same."""
    if frame == bag.world_frame or frame == TABLE_FRAME and not bag.table_known:
        return None
    there = BagScene(bag.path, frame).source_cameras[0].T_world_camera
    return bag.cameras[0].T_world_camera @ inverse(there)


def _images(bag: BagScene) -> dict[str, list[tuple[int, int]]]:
    """Return {camera: (stamp, when it was recorded) of each image}, ns."""
    camera_of = {topic: name for name, topic in bag.depth_topics.items()}
    images: dict[str, list[tuple[int, int]]] = {name: [] for name in bag.depth_topics}
    for message in iter_messages(bag.path, camera_of.keys()):
        stamp = nanoseconds(read_image(message, bag.path).header.stamp)
        images[camera_of[message.topic.name]].append((stamp, message.time_ns))
    return images


def _recorded(stamp_ns: int, images: Mapping[str, Sequence[tuple[int, int]]]) -> bool:
    """
    Return whether the frame set of a stamp was recorded.

    It has the stamp of its oldest image. Other results are of earlier images, or say that
    results are no longer valid.
    """
    stamps = [[stamp for stamp, _ in of_camera] for of_camera in images.values()]
    return any(stamp_ns in of_camera for of_camera in stamps) and all(
        max(of_camera, default=0) >= stamp_ns for of_camera in stamps)


def _result(path: Path, stamp_ns: int, parts: Mapping[str, Mapping[int, Any]],
            images: Mapping[str, Sequence[tuple[int, int]]], written_ns: int) -> FrameSetResult:
    """Return one result."""
    mine = {topic: kept[stamp_ns] for topic, kept in parts.items() if stamp_ns in kept}
    chosen = images_of(stamp_ns, {camera: [stamp for stamp, _ in of_camera]
                                  for camera, of_camera in images.items()})
    arrived_ns = max(images[camera][index][1] for camera, index in chosen.items())
    try:
        return frame_set_result(stamp_ns, mine, max(0.0, (written_ns - arrived_ns) * 1e-9),
                                chosen)
    except (HoocError, KeyError, ValueError, TypeError) as error:
        raise HoocError(f'{path}: the result of {stamp_ns} ns cannot be read: {error}') from None


def _model_folder(labels: Mapping[str, Any]) -> Path | None:
    """Return the MODEL folder of the meshes that `objects/labels` names, None if it is gone."""
    classes = labels.get('classes')
    for label in classes.values() if isinstance(classes, dict) else ():
        uri = label.get('mesh') if isinstance(label, dict) else None
        if isinstance(uri, str) and uri.startswith('file://'):
            folder = Path(unquote(urlsplit(uri).path)).parent.parent
            return folder if (folder / 'model.json').is_file() else None
    return None

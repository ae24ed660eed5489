# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Write recorded scenes as rosbag2 bags (docs/bags.md)."""

from collections.abc import Iterable, Iterator, Sequence
import json
from pathlib import Path
import shutil
import tempfile
from typing import Any, Protocol, TYPE_CHECKING

from hooc_perception.core.arrays import UInt8Array
from hooc_perception.core.geometry import pose_from_matrix
from hooc_perception.core.segment.checks import same_calibration
from hooc_perception.core.types import Camera, DepthView
from hooc_perception.errors import HoocError
from hooc_perception.io.bags.bag_format import (
    CAMERA_INFO,
    IMAGE,
    METADATA_VERSION,
    offered_qos,
    STORAGES,
    STRING,
    TF,
    TRANSFORM,
    TYPES,
)
from hooc_perception.io.bags.mcap_checks import write_checksums
from hooc_perception.io.depth_encodings import encode_depth, METRES, MILLIMETRES
from hooc_perception.io.scenes.scene import RecordedScene, TrueObject
from hooc_perception.io.scenes.sequences import RecordedSequence
from hooc_perception.io.scenes.writer import true_object_entry
import numpy as np
from rosbags.interfaces import Qos
from rosbags.rosbag2 import Writer

if TYPE_CHECKING:
    from hooc_perception.io.scenes.scene_set import SceneSet

NAMESPACE = '/hooc'
INFO_TOPIC = f'{NAMESPACE}/scene_info'
INFO_FORMAT = 'hooc-scene-info/1'
# Scene sets have no stamps; fixed ones make the same scene give the same bag.
FIRST_STAMP_NS = 1_000_000_000 * 10 ** 9
# Latched topics come first, so that a player has sent them when the first image comes.
LEAD_NS = 10 ** 8
_SECOND_NS = 10 ** 9
# Topic, message type and message.
_Outgoing = tuple[str, str, Any]
# Seconds after the first frame set, and the messages.
_FrameSets = Iterable[tuple[float, Iterable[_Outgoing]]]


class WritableScene(Protocol):
    """What `write_bag` needs of a scene; RecordedScene is one."""

    @property
    def name(self) -> str:
        """Return the scene's name."""
        ...

    @property
    def cameras(self) -> tuple[Camera, ...]:
        """Return the cameras, posed in the world frame."""
        ...

    @property
    def depth_units(self) -> tuple[float, ...]:
        """Return the metres per count of the recording, one per camera."""
        ...

    @property
    def truth(self) -> tuple[TrueObject, ...] | None:
        """Return the ground truth, None without annotation."""
        ...

    @property
    def world(self) -> dict[str, Any]:
        """Return the description of an estimated world frame, {} if it is known."""
        ...

    def depth(self) -> tuple[DepthView, ...]:
        """Return one DepthView per camera."""
        ...

    def labels(self) -> dict[str, UInt8Array] | None:
        """Return {camera: (H, W) uint8 instance labels}, None without labels."""
        ...


# pyright does not accept the cached properties of RecordedScene as properties of a protocol.
AnyWritable = RecordedScene | WritableScene


def optical_frame(camera_name: str) -> str:
    """Return the name of a camera's optical frame."""
    return f'{camera_name}_depth_optical_frame'


def write_bag(scene: AnyWritable, scene_set: 'SceneSet', out_dir: str | Path,
              storage: str = 'mcap', repeat: int = 1, rate: float = 10.0) -> Path:
    """
    Write one scene as the bag out_dir/<scene> and return its path.

    Depth in millimetres is written as 16UC1, in another unit as 32FC1, so that nothing is
    rounded and a bag parses to the same objects as its scene set.

    :param scene_set: the set of the scene: name, categories, limits, world frame.
    :param storage: 'mcap' or 'sqlite3'.
    :param repeat: number of frame sets; the same images each time, with new stamps.
    :param rate: frame sets per second.
    :raises HoocError: if the bag exists already or the scene cannot be read.
    """
    if repeat < 1 or not 0 < rate <= 1000:
        raise HoocError(f'{repeat} frame sets at {rate} Hz cannot be written; '
                        'repeat at least once, at a rate of up to 1000 Hz')
    path = _new_bag(out_dir, scene.name, storage)
    latched = [*_latched(scene.cameras, scene_set, scene_info(scene, scene_set)), *_labels(scene)]
    images = list(_images(scene))
    return _written(path, storage, latched, ((i / rate, images) for i in range(repeat)))


def write_sequence(sequence: RecordedSequence, scene_set: 'SceneSet', out_dir: str | Path,
                   storage: str = 'mcap') -> Path:
    """
    Write all frame sets of a sequence as the bag out_dir/<sequence> and return its path.

    Instance labels are left out: they belong to one frame set.

    :param scene_set: the set of the sequence and its scenes.
    :param storage: 'mcap' or 'sqlite3'.
    :raises HoocError: as `write_bag`, and if the cameras are not the same in all scenes.
    """
    path = _new_bag(out_dir, sequence.name, storage)
    scenes = [scene_set.scene(name) for name in sequence.scenes]
    first = scenes[0]
    for scene in scenes:
        if not all(map(same_calibration, scene.cameras, first.cameras)):
            raise HoocError(f'{scene_set.path}: the cameras of {scene.name} are not those of '
                            f'{first.name}, and a bag holds one pose of each; take the sequence '
                            f'{sequence.name} out of sequences.yaml to convert its scenes')
    info = {**scene_info(first, scene_set), 'scene': sequence.name, 'truth': None, 'sequence': {
        'period_s': sequence.period_s, 'events': sequence.events,
        'frame_sets': [{'scene': scene.name, 'truth': _truth(scene)} for scene in scenes]}}
    return _written(path, storage, _latched(first.cameras, scene_set, info),
                    ((i * sequence.period_s, _images(scene)) for i, scene in enumerate(scenes)))


def scene_info(scene: AnyWritable, scene_set: 'SceneSet') -> dict[str, Any]:
    """Return the dict that /hooc/scene_info carries as JSON."""
    return {'format': INFO_FORMAT, 'dataset': scene_set.name, 'scene': scene.name,
            'world_frame': scene_set.world_frame, 'depth_unit': 0.001,
            'cameras': [camera.name for camera in scene.cameras],
            'categories': list(scene_set.category_names),
            'max_instances': scene_set.max_instances, 'truth': _truth(scene), **scene.world}


def _truth(scene: AnyWritable) -> list[dict[str, Any]] | None:
    """Return the ground truth of a scene as plain data, None without annotation."""
    truth = scene.truth
    return None if truth is None else [true_object_entry(true) for true in truth]


def _new_bag(out_dir: str | Path, name: str, storage: str) -> Path:
    """Return the path of a bag that does not exist yet."""
    if storage not in STORAGES:
        raise HoocError(f'storage is {storage!r}; choose one of {", ".join(STORAGES)}')
    path = Path(out_dir) / name
    if path.exists():
        raise HoocError(f'{path}: exists already; remove it or choose another folder')
    return path


def _written(path: Path, storage: str, latched: Iterable[_Outgoing],
             frame_sets: _FrameSets) -> Path:
    """Write a bag and return its path; nothing is left there if that fails."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=path.parent, prefix='.') as partial:
            # The file inside is named after its folder, which therefore has its final name.
            _write(Path(partial) / path.name, storage, latched, frame_sets)
            shutil.move(Path(partial) / path.name, path)
    except OSError as error:
        raise HoocError(f'{path}: cannot be written ({error.strerror}); '
                        'choose another place or free some space') from None
    return path


def _write(path: Path, storage: str, latched: Iterable[_Outgoing],
           frame_sets: _FrameSets) -> None:
    """Write all messages in the order of time."""
    with Writer(path, version=METADATA_VERSION, storage_plugin=STORAGES[storage]) as writer:
        connections = {}

        def write(topic: str, kind: str, message: Any, stamp_ns: int, qos: Qos) -> None:
            if topic not in connections:
                connections[topic] = writer.add_connection(
                    topic, kind, typestore=TYPES, offered_qos_profiles=[qos])
            writer.write(connections[topic], stamp_ns, TYPES.serialize_cdr(message, kind))

        for topic, kind, message in latched:
            write(topic, kind, message, FIRST_STAMP_NS, offered_qos(latched=True))
        for seconds, images in frame_sets:
            stamp_ns = FIRST_STAMP_NS + LEAD_NS + round(seconds * _SECOND_NS)
            for topic, kind, message in images:
                message.header.stamp = _time(stamp_ns)
                write(topic, kind, message, stamp_ns, offered_qos(latched=False))
    if storage == 'mcap':
        write_checksums(path / f'{path.name}.mcap')


def _latched(cameras: Sequence[Camera], scene_set: 'SceneSet',
             info: dict[str, Any]) -> Iterator[_Outgoing]:
    """Yield the description and the poses of the cameras, on latched topics."""
    types = TYPES.types
    transforms = [_transform(camera, scene_set.world_frame) for camera in cameras]
    yield INFO_TOPIC, STRING, types[STRING](json.dumps(info))
    yield '/tf_static', TF, types[TF](transforms)
    for camera, transform in zip(cameras, transforms):
        yield f'{NAMESPACE}/{camera.name}/extrinsics', TRANSFORM, transform


def _labels(scene: AnyWritable) -> Iterator[_Outgoing]:
    """Yield the instance labels, on latched topics."""
    for camera, labels in (scene.labels() or {}).items():
        yield (f'{NAMESPACE}/{camera}/instance_labels', IMAGE,
               _image(labels.tobytes(), labels.shape, 'mono8', labels.shape[1], camera))


def _images(scene: AnyWritable) -> Iterator[_Outgoing]:
    """Yield the messages of one frame set: every image and its CameraInfo."""
    for view, unit in zip(scene.depth(), scene.depth_units):
        topic = f'{NAMESPACE}/{view.camera.name}/depth'
        yield f'{topic}/camera_info', CAMERA_INFO, _camera_info(view.camera)
        encoding = MILLIMETRES if unit == 0.001 else METRES
        data, step, _ = encode_depth(view.depth, encoding)
        yield (f'{topic}/image_raw', IMAGE,
               _image(data, view.depth.shape, encoding, step, view.camera.name))


def _image(data: bytes, shape: tuple[int, ...], encoding: str, step: int,
           camera_name: str) -> Any:
    """Return an Image message."""
    return TYPES.types[IMAGE](_header(optical_frame(camera_name)), *shape, encoding, 0, step,
                              np.frombuffer(data, np.uint8))


def _camera_info(camera: Camera) -> Any:
    """Return the CameraInfo of a raw camera: K, D, and a P without skew."""
    types = TYPES.types
    P = np.zeros((3, 4))
    P[:, :3] = camera.K
    P[0, 1] = 0
    return types[CAMERA_INFO](
        header=_header(optical_frame(camera.name)), height=camera.height, width=camera.width,
        distortion_model=camera.distortion_model, d=np.asarray(camera.D, np.float64),
        k=np.ravel(camera.K).astype(np.float64), r=np.eye(3).ravel(), p=P.ravel(),
        binning_x=0, binning_y=0,
        roi=types['sensor_msgs/msg/RegionOfInterest'](0, 0, 0, 0, False))


def _transform(camera: Camera, world_frame: str) -> Any:
    """Return the TransformStamped world -> optical frame of a camera."""
    types = TYPES.types
    translation, rotation = pose_from_matrix(camera.T_world_camera)
    return types[TRANSFORM](
        _header(world_frame), optical_frame(camera.name),
        types['geometry_msgs/msg/Transform'](
            types['geometry_msgs/msg/Vector3'](*translation.tolist()),
            types['geometry_msgs/msg/Quaternion'](*rotation.tolist())))


def _header(frame_id: str, stamp_ns: int = FIRST_STAMP_NS) -> Any:
    """Return a Header."""
    return TYPES.types['std_msgs/msg/Header'](_time(stamp_ns), frame_id)


def _time(stamp_ns: int) -> Any:
    """Return a Time message."""
    return TYPES.types['builtin_interfaces/msg/Time'](*divmod(stamp_ns, _SECOND_NS))

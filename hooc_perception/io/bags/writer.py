# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Write recorded scenes as rosbag2 bags (docs/bags.md)."""

import json
from pathlib import Path
import shutil
import tempfile

from hooc_perception.core.geometry import pose_from_matrix
from hooc_perception.errors import HoocError
from hooc_perception.io.bags import mcap_file
from hooc_perception.io.depth_encodings import encode_depth, METRES, MILLIMETRES
from hooc_perception.io.scenes.writer import true_object_entry
import numpy as np
from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import get_typestore, Stores

NAMESPACE = '/hooc'
INFO_TOPIC = f'{NAMESPACE}/scene_info'
INFO_FORMAT = 'hooc-scene-info/1'
STORAGES = {'mcap': StoragePlugin.MCAP, 'sqlite3': StoragePlugin.SQLITE3}
# Stamps are invented, since scene sets hold none: the same scene gives the same bag.
FIRST_STAMP_NS = 1_000_000_000 * 10 ** 9
# Latched topics come first, so that a player has sent them when the first image comes.
LEAD_NS = 10 ** 8
_SECOND_NS = 10 ** 9
_INFINITE = QosTime(9223372036, 854775807)

TYPES = get_typestore(Stores.ROS2_JAZZY)
IMAGE = 'sensor_msgs/msg/Image'
CAMERA_INFO = 'sensor_msgs/msg/CameraInfo'
TRANSFORM = 'geometry_msgs/msg/TransformStamped'
TF = 'tf2_msgs/msg/TFMessage'
STRING = 'std_msgs/msg/String'


def optical_frame(camera_name):
    """Return the name of a camera's optical frame."""
    return f'{camera_name}_depth_optical_frame'


def write_bag(scene, scene_set, out_dir, storage='mcap', repeat=1, rate=10.0):
    """
    Write one scene as the bag out_dir/<scene> and return its path.

    Depth in millimetres goes out as 16UC1, in another unit as 32FC1, so that nothing is
    rounded and a bag parses to the same objects as its scene set.

    :param scene: RecordedScene, or anything with its name, cameras, depth(), labels() and truth.
    :param scene_set: SceneSet that the scene is of: name, categories, limits, world frame.
    :param storage: 'mcap' or 'sqlite3'.
    :param repeat: number of frame sets; the same images each time, with new stamps.
    :param rate: frame sets a second.
    :raises HoocError: where the bag exists already or the scene cannot be read.
    """
    if storage not in STORAGES:
        raise HoocError(f'storage is {storage!r}; choose one of {", ".join(STORAGES)}')
    if repeat < 1 or not 0 < rate <= 1000:
        raise HoocError(f'{repeat} frame sets at {rate} Hz cannot be written; '
                        'repeat at least once, at a rate of up to 1000 Hz')
    path = Path(out_dir) / scene.name
    if path.exists():
        raise HoocError(f'{path}: exists already; remove it or choose another folder')
    messages = list(_latched(scene, scene_set)), list(_images(scene))
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=path.parent, prefix='.') as partial:
            # The file inside is named after its folder, which therefore has its final name.
            _write(Path(partial) / scene.name, storage, *messages, repeat, rate)
            shutil.move(Path(partial) / scene.name, path)
    except OSError as error:
        raise HoocError(f'{path}: cannot be written ({error.strerror}); '
                        'choose another place or free some space') from None
    return path


def scene_info(scene, scene_set):
    """Return the dict that /hooc/scene_info holds as JSON."""
    truth = scene.truth
    return {'format': INFO_FORMAT, 'dataset': scene_set.name, 'scene': scene.name,
            'world_frame': scene_set.world_frame, 'depth_unit': 0.001,
            'cameras': [camera.name for camera in scene.cameras],
            'categories': list(scene_set.category_names),
            'max_instances': scene_set.max_instances,
            'truth': None if truth is None else [true_object_entry(true) for true in truth],
            **scene.world}


def _write(path, storage, latched, images, repeat, rate):
    """Write all messages in the order of time."""
    with Writer(path, version=9, storage_plugin=STORAGES[storage]) as writer:
        connections = {}

        def write(topic, kind, message, stamp_ns, qos):
            if topic not in connections:
                connections[topic] = writer.add_connection(
                    topic, kind, typestore=TYPES, offered_qos_profiles=[qos])
            writer.write(connections[topic], stamp_ns, TYPES.serialize_cdr(message, kind))

        for topic, kind, message in latched:
            write(topic, kind, message, FIRST_STAMP_NS, _qos(latched=True))
        for i in range(repeat):
            stamp_ns = FIRST_STAMP_NS + LEAD_NS + round(i * _SECOND_NS / rate)
            for topic, kind, message in images:
                message.header.stamp = _time(stamp_ns)
                write(topic, kind, message, stamp_ns, _qos(latched=False))
    if storage == 'mcap':
        mcap_file.seal(path / f'{path.name}.mcap')


def _latched(scene, scene_set):
    """Yield (topic, type, message) of what is sent once and kept."""
    types = TYPES.types
    transforms = [_transform(camera, scene_set.world_frame) for camera in scene.cameras]
    yield INFO_TOPIC, STRING, types[STRING](json.dumps(scene_info(scene, scene_set)))
    yield '/tf_static', TF, types[TF](transforms)
    for camera, transform in zip(scene.cameras, transforms):
        yield f'{NAMESPACE}/{camera.name}/extrinsics', TRANSFORM, transform
    for camera, labels in (scene.labels() or {}).items():
        yield (f'{NAMESPACE}/{camera}/instance_labels', IMAGE,
               _image(labels.tobytes(), labels.shape, 'mono8', labels.shape[1], camera))


def _images(scene):
    """Yield (topic, type, message) of one frame set: every image and its CameraInfo."""
    for view, unit in zip(scene.depth(), scene.depth_units):
        topic = f'{NAMESPACE}/{view.camera.name}/depth'
        yield f'{topic}/camera_info', CAMERA_INFO, _camera_info(view.camera)
        encoding = MILLIMETRES if unit == 0.001 else METRES
        data, step, _ = encode_depth(view.depth, encoding)
        yield (f'{topic}/image_raw', IMAGE,
               _image(data, view.depth.shape, encoding, step, view.camera.name))


def _image(data, shape, encoding, step, camera_name):
    """Return an Image message."""
    return TYPES.types[IMAGE](_header(optical_frame(camera_name)), *shape, encoding, 0, step,
                              np.frombuffer(data, np.uint8))


def _camera_info(camera):
    """Return the CameraInfo of a Camera: raw, so K and D; what P says has no skew."""
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


def _transform(camera, world_frame):
    """Return the TransformStamped world -> optical frame of a camera."""
    types = TYPES.types
    translation, rotation = pose_from_matrix(camera.T_world_camera)
    return types[TRANSFORM](
        _header(world_frame), optical_frame(camera.name),
        types['geometry_msgs/msg/Transform'](
            types['geometry_msgs/msg/Vector3'](*translation.tolist()),
            types['geometry_msgs/msg/Quaternion'](*rotation.tolist())))


def _header(frame_id, stamp_ns=FIRST_STAMP_NS):
    """Return a Header."""
    return TYPES.types['std_msgs/msg/Header'](_time(stamp_ns), frame_id)


def _time(stamp_ns):
    """Return a Time message."""
    return TYPES.types['builtin_interfaces/msg/Time'](*divmod(stamp_ns, _SECOND_NS))


def _qos(latched):
    """Return the profile of a latched topic, or that of the images: reliable, volatile."""
    return Qos(QosHistory.KEEP_LAST, 1 if latched else 10, QosReliability.RELIABLE,
               QosDurability.TRANSIENT_LOCAL if latched else QosDurability.VOLATILE,
               _INFINITE, _INFINITE, QosLiveliness.AUTOMATIC, _INFINITE, False)

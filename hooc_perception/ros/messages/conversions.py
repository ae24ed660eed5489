# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Lossless conversions between camera messages and core types.

Poses travel as (translation, quaternion) in float64. `core.geometry.canonical_pose` turns them
into matrices, as rectification does, so that every process has the same matrix as a
single-process run.
"""

from array import array
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Pose, PoseArray, TransformStamped
from hooc_perception.core.arrays import AnyArray, Float32Array, Float64Array, UInt8Array
from hooc_perception.core.geometry import canonical_pose, matrix_from_pose
from hooc_perception.core.types import Camera
from hooc_perception.errors import HoocError
from hooc_perception.io.camera_info import camera_from_info
from hooc_perception.io.depth_encodings import decode_depth, decode_image, METRES
import numpy as np
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Header


def nanoseconds(stamp: Time) -> int:
    """Return a builtin_interfaces/Time in integer nanoseconds."""
    return stamp.sec * 1_000_000_000 + stamp.nanosec


def time_message(stamp_ns: int) -> Time:
    """Return integer nanoseconds as a builtin_interfaces/Time."""
    return Time(sec=int(stamp_ns // 1_000_000_000), nanosec=int(stamp_ns % 1_000_000_000))


def header(stamp_ns: int, frame_id: str) -> Header:
    """Return the Header with this stamp (ns) and frame."""
    return Header(stamp=time_message(stamp_ns), frame_id=frame_id)


def message_bytes(pixels: AnyArray) -> 'array[int]':
    """
    Return the bytes of an ndarray as the array('B') that the `data` field of a message takes.

    Filling it from a memoryview is several times faster than from bytes, and rclpy accepts an
    array without checking every element.
    """
    data = array('B')
    pixels = np.ascontiguousarray(pixels)
    if pixels.size:
        data.frombytes(pixels.reshape(-1).view(np.uint8).data)
    return data


def image_message(pixels: AnyArray, encoding: str, head: Header) -> Image:
    """Return the Image of an (H, W) little-endian array, with rows packed."""
    return Image(header=head, height=pixels.shape[0], width=pixels.shape[1], encoding=encoding,
                 is_bigendian=0, step=pixels.shape[1] * pixels.itemsize,
                 data=message_bytes(pixels))


def depth_message(depth: Float32Array, head: Header) -> Image:
    """Return the 32FC1 Image of (H, W) float32 metres, NaN = no reading."""
    return image_message(np.asarray(depth, np.dtype('<f4')), METRES, head)


def copied_image(message: Any) -> Image:
    """Return a message with the fields of an Image, as rosbags has them, as an Image of rclpy."""
    stamp = message.header.stamp
    return Image(header=header(stamp.sec * 1_000_000_000 + stamp.nanosec,
                               message.header.frame_id),
                 height=message.height, width=message.width, encoding=message.encoding,
                 is_bigendian=int(message.is_bigendian), step=message.step,
                 data=message_bytes(np.asarray(message.data)))


def depth_from_message(message: Image, unit: float | None = None) -> Float32Array:
    """
    Return (H, W) float32 metres, NaN = no reading, from a depth Image.

    :param unit: metres per count; None = as the encoding says.
    :raises HoocError: if the encoding or the layout is not that of a depth image.
    """
    return decode_depth(message.data, message.height, message.width, message.encoding,
                        message.step, bool(message.is_bigendian), unit)


def labels_message(labels: UInt8Array, head: Header) -> Image:
    """Return the mono8 Image of (H, W) uint8 class ids."""
    return image_message(np.asarray(labels, np.uint8), 'mono8', head)


def labels_from_message(message: Image) -> UInt8Array:
    """Return (H, W) uint8 class ids from a mono8 Image; HoocError for other encodings."""
    if message.encoding not in ('mono8', '8UC1'):
        raise HoocError(f'encoding {message.encoding!r} is not a label image; publish mono8')
    return decode_image(message.data, message.height, message.width, np.uint8, message.step)


def camera_info_message(camera: Camera, head: Header) -> CameraInfo:
    """Return the CameraInfo of a monocular Camera (R = identity, P = [K 0])."""
    P = np.hstack([camera.K, np.zeros((3, 1))])
    return CameraInfo(header=head, height=camera.height, width=camera.width,
                      distortion_model=camera.distortion_model,
                      d=np.asarray(camera.D, np.float64).tolist(),
                      k=np.asarray(camera.K, np.float64).reshape(-1), r=np.eye(3).reshape(-1),
                      p=P.reshape(-1))


def transform_message(translation: Iterable[float], rotation_xyzw: Iterable[float], head: Header,
                      child_frame_id: str) -> TransformStamped:
    """Return T_parent_child as a TransformStamped; `head.frame_id` is the parent."""
    message = TransformStamped(header=head, child_frame_id=child_frame_id)
    t, q = message.transform.translation, message.transform.rotation
    t.x, t.y, t.z = (float(x) for x in translation)
    q.x, q.y, q.z, q.w = (float(x) for x in rotation_xyzw)
    return message


def pose_of_transform(message: TransformStamped) -> tuple[Float64Array, Float64Array]:
    """Return (translation (3,), rotation_xyzw (4,)) float64 of a TransformStamped, as it is."""
    t, q = message.transform.translation, message.transform.rotation
    return np.array([t.x, t.y, t.z]), np.array([q.x, q.y, q.z, q.w])


def camera_from_messages(name: str, info: CameraInfo, transform: TransformStamped,
                         size: tuple[int, int] | None = None,
                         rectified: bool = False) -> Camera:
    """
    Return the Camera that a CameraInfo and its extrinsics describe.

    :param transform: T_world_camera, camera optical frame to world.
    :param size: (width, height) of the images; None takes that of the calibration.
    :param rectified: the images are rectified already.
    :raises HoocError: if the calibration is unusable; names the camera and the field.
    """
    camera = camera_from_info(name, info, size, rectified, f'camera_info of {name}')
    translation, rotation = pose_of_transform(transform)
    if not is_rigid(translation, rotation):
        raise HoocError(f'the extrinsics of {name} are not a rigid transform (translation '
                        f'{translation.tolist()}, rotation {rotation.tolist()}); the quaternion '
                        'must have norm 1')
    return replace(camera, T_world_camera=canonical_pose(matrix_from_pose(translation, rotation)))


def is_rigid(translation: Float64Array, rotation_xyzw: Float64Array) -> bool:
    """Return whether a (3,) translation is finite and a (4,) quaternion has norm 1."""
    return bool(np.isfinite(translation).all() and abs(np.linalg.norm(rotation_xyzw) - 1) < 1e-2)


def pose_message(translation: Float64Array, rotation_xyzw: Float64Array) -> Pose:
    """Return the Pose of (3,) and (4,) float64, exact to the last bit."""
    pose = Pose()
    p, q = pose.position, pose.orientation
    p.x, p.y, p.z = np.asarray(translation).tolist()
    q.x, q.y, q.z, q.w = np.asarray(rotation_xyzw).tolist()
    return pose


def pose_array_message(translation: Float64Array, rotation_xyzw: Float64Array,
                       head: Header) -> PoseArray:
    """Return the PoseArray of (n, 3) and (n, 4) float64, exact to the last bit."""
    return PoseArray(header=head, poses=[
        pose_message(t, q) for t, q in zip(translation, rotation_xyzw)])


def poses_from_message(message: PoseArray) -> tuple[Float64Array, Float64Array]:
    """Return ((n, 3) translations, (n, 4) xyzw quaternions) float64 of a PoseArray."""
    rows = np.array([(p.position.x, p.position.y, p.position.z, p.orientation.x,
                      p.orientation.y, p.orientation.z, p.orientation.w) for p in message.poses])
    rows = rows.reshape(-1, 7)
    return rows[:, :3].copy(), rows[:, 3:].copy()

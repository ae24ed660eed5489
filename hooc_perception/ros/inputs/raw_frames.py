# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The messages of one raw camera -> a usable frame, or the reason why there is none."""

from collections.abc import Callable
from dataclasses import dataclass
import textwrap
from typing import Any, TypeVar

from geometry_msgs.msg import TransformStamped
from hooc_perception.core.arrays import BoolArray, Float32Array, UInt8Array
from hooc_perception.core.segment.checks import (
    pose_trouble,
    reading_trouble,
    same_calibration,
)
from hooc_perception.core.segment.config import ObserveConfig
from hooc_perception.core.segment.fusion import Fusion
from hooc_perception.core.types import Camera, DepthView
from hooc_perception.errors import HoocError
from hooc_perception.io.camera_info import SizeMismatch
from hooc_perception.io.depth_units import depth_unit_error
from hooc_perception.ros.inputs.image_notes import ImageNotes
from hooc_perception.ros.messages.conversions import (
    camera_from_messages,
    depth_from_message,
    nanoseconds,
)
import numpy as np
from sensor_msgs.msg import CameraInfo, Image

T = TypeVar('T')


class FrameRefused(HoocError):
    """A frame that cannot be used; `code` is the reason in short."""

    def __init__(self, code: str, sentence: str) -> None:
        """Keep the code beside the sentence."""
        super().__init__(sentence)
        self.code = code


@dataclass(frozen=True)
class RawFrame:
    """
    A decoded frame.

    :ivar camera: Camera.
    :ivar depth: (H, W) float32 metres, raw, NaN = none.
    :ivar frame_id: of the optical frame.
    :ivar stamp_ns: of the image.
    :ivar hidden: (H, W) bool, pixels where the robot hides the scene, see DepthView.
    """

    camera: Camera
    depth: Float32Array
    frame_id: str
    stamp_ns: int = 0
    hidden: BoolArray | None = None


class RawFrames:
    """
    Decode the frames of one camera, reject implausible ones, remember the last few.

    :ivar camera: the Camera of the last good frame, None before.
    """

    def __init__(self, name: str, stated: Callable[[], ImageNotes] = ImageNotes) -> None:
        """
        Begin without any frame of the camera of that name.

        :param stated: returns what the user states of its images, as it is now.
        """
        self.name, self._stated = name, stated
        self.camera: Camera | None = None
        # The last Camera, and the content of the messages that it was built from.
        self._known: tuple[tuple[Any, ...], Camera] | None = None
        self._fusion = Fusion()

    def decode(self, image: Image, info: CameraInfo, transform: TransformStamped,
               config: ObserveConfig) -> RawFrame:
        """
        Return the RawFrame of three messages.

        :param config: how it will be observed: beyond `max_depth_m` no reading counts, and
            cameras are above a table that lies at z = 0 (`table`).
        :raises FrameRefused: with the code `bad_calibration`, `bad_extrinsics`,
            `absurd_extrinsics`, `bad_image`, `size_mismatch`, `wrong_unit` or `no_readings`.
        """
        stated = self._stated()
        # First: a damaged image says nothing of the size that its calibration must have.
        depth = _refusing('bad_image', depth_from_message, image, stated.depth_unit)
        camera = self._camera(image, info, transform, bool(stated.rectified))
        if config.table == 'fixed':
            _refuse('absurd_extrinsics', pose_trouble(camera), f'camera {self.name}: ')
        _refuse('wrong_unit', depth_unit_error(depth, image.encoding, config.max_depth_m))
        _refuse('no_readings', reading_trouble(depth))
        if self.camera is not None and not same_calibration(camera, self.camera):
            self._fusion.forget()
        self.camera = camera
        return RawFrame(camera, depth, image.header.frame_id, nanoseconds(image.header.stamp))

    def remember(self, depth: Float32Array, frames: int) -> None:
        """
        Keep an image for fusion.

        :param frames: how many to keep; 1 keeps nothing of the past.
        """
        if frames > 1:
            self._fusion.add(depth, frames)
        else:
            self.forget()

    def forget(self) -> None:
        """Forget the images that were kept for fusion."""
        self._fusion.forget()

    def view(self, frame: RawFrame) -> tuple[DepthView, UInt8Array | None]:
        """
        Return a frame as DepthView, fused with the remembered ones.

        :return: (view; (H, W) number of readings per pixel, None if nothing was fused).
        """
        if len(self._fusion) < 2:
            return DepthView(frame.camera, frame.depth, frame.hidden), None
        depth, count = self._fusion.fused()
        # Earlier images may have seen what the robot hides now.
        hidden = None if frame.hidden is None else frame.hidden & np.isnan(depth)
        return DepthView(frame.camera, depth, hidden), count

    def _camera(self, image: Image, info: CameraInfo, transform: TransformStamped,
                rectified: bool) -> Camera:
        """Return the Camera of three messages; the same object while they say the same."""
        size = image.width, image.height
        key = (*size, info.width, info.height, info.k.tobytes(), info.p.tobytes(), tuple(info.d),
               info.distortion_model, info.binning_x, info.binning_y, str(info.roi), rectified,
               str(transform.transform))
        if self._known and key == self._known[0]:
            return self._known[1]
        try:
            camera_from_messages(self.name, info, TransformStamped(), size, rectified)
        except HoocError as error:
            raise FrameRefused('size_mismatch' if isinstance(error, SizeMismatch)
                               else 'bad_calibration', _short(error)) from error
        camera = _refusing('bad_extrinsics', camera_from_messages, self.name, info, transform,
                           size, rectified)
        self._known = key, camera
        return camera


def _refusing(code: str, function: Callable[..., T], *args: Any) -> T:
    """Return function(*args); a HoocError becomes a FrameRefused of limited length."""
    try:
        return function(*args)
    except HoocError as error:
        raise FrameRefused(code, _short(error)) from error


def _short(error: HoocError) -> str:
    """Return the sentence of an error at a limited length."""
    return textwrap.shorten(str(error), 500, placeholder=' ...')


def _refuse(code: str, trouble: str | None, before: str = '') -> None:
    """Raise FrameRefused if there is trouble."""
    if trouble:
        raise FrameRefused(code, before + trouble)

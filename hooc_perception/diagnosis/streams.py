# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Check the topics of a bag: depth images, their stamps and synchrony, latched transforms."""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hooc_perception.core.segment.config import ObserveConfig
from hooc_perception.diagnosis.finding import ERROR, Finding, OK, WARNING
from hooc_perception.errors import HoocError
from hooc_perception.io.bags.camera_topics import camera_of_topic
from hooc_perception.io.bags.files import BagTopic, iter_messages
from hooc_perception.io.bags.images import may_hold_depth, read_image
from hooc_perception.io.bags.notes import PerCamera
from hooc_perception.io.depth_encodings import decode_depth, DEPTH_ENCODINGS
from hooc_perception.io.depth_units import depth_unit_error
import numpy as np

IMAGE, INFO = 'sensor_msgs/msg/Image', 'sensor_msgs/msg/CameraInfo'
# The defaults of the ingestion node: max_set_spread_s and max_frame_age_s.
MAX_SPREAD_S, MAX_LAG_S = 0.1, 1.0
FEW_READINGS = 0.2
# Stamps below this (1973) are not of a computer's clock: simulators and some sensors begin at 0.
EPOCH_S = 1e8


@dataclass
class DepthStream:
    """
    Statistics of the images of one depth topic.

    :ivar count: number of images, readable or not.
    :ivar sizes: (width, height) of the images.
    :ivar stamps: header stamps, s.
    :ivar readings: share of pixels with a reading, per image.
    :ivar damage: one sentence per unreadable image.
    :ivar units: one sentence per image that seems to be in another unit.
    :ivar lags: recording time minus header stamp, s.
    """

    count: int = 0
    sizes: set[tuple[int, int]] = field(default_factory=set)
    encodings: set[str] = field(default_factory=set)
    stamps: list[float] = field(default_factory=list)
    readings: list[float] = field(default_factory=list)
    damage: list[str] = field(default_factory=list)
    units: list[str] = field(default_factory=list)
    lags: list[float] = field(default_factory=list)

    def add(self, image: Any, time_ns: int, unit: float | None = None) -> None:
        """
        Include one Image message.

        :param time_ns: when it was recorded.
        :param unit: metres per count, None = as its encoding says.
        """
        self.sizes.add((image.width, image.height))
        self.encodings.add(image.encoding)
        self.stamps.append(image.header.stamp.sec + image.header.stamp.nanosec * 1e-9)
        self.lags.append(time_ns * 1e-9 - self.stamps[-1])
        try:
            depth = decode_depth(image.data, image.height, image.width, image.encoding,
                                 image.step, image.is_bigendian, unit)
        except HoocError as error:
            self.damage.append(str(error))
            return
        seen = np.isfinite(depth)
        self.readings.append(float(seen.mean()))
        if trouble := depth_unit_error(depth, image.encoding, ObserveConfig().max_depth_m):
            self.units.append(trouble)


def read_streams(path: Path, known: Mapping[str, BagTopic],
                 units: PerCamera[float] = PerCamera()) -> tuple[
        dict[str, Any], dict[str, Any], dict[str, DepthStream]]:
    """
    Read every depth image once.

    :param known: {topic: BagTopic}.
    :param units: metres per count, where the user states them.
    :return: ({topic: first Image}, {topic: first CameraInfo}, {topic: DepthStream}).
    """
    firsts: dict[str, Any] = {}
    infos: dict[str, Any] = {}
    streams: defaultdict[str, DepthStream] = defaultdict(DepthStream)
    wanted = {name for name, topic in known.items()
              if topic.type_name == INFO or may_hold_depth(topic)}
    for message in iter_messages(path, wanted):
        name = message.topic.name
        if message.topic.type_name == INFO:
            if name not in infos:
                infos[name] = message.read(path)
            continue
        stream = streams[name]
        stream.count += 1
        try:
            image: Any = read_image(message, path)
        except HoocError as error:
            stream.damage.append(str(error))
            continue
        firsts.setdefault(name, image)
        if 'depth' in name.lower() or image.encoding in DEPTH_ENCODINGS:
            stream.add(image, message.time_ns, units.of(camera_of_topic(name)))
    return firsts, infos, streams


def check_stream(topic: str, stream: DepthStream, known: BagTopic) -> Iterator[Finding]:
    """Yield a Finding for each check of one depth topic; a single OK if all is well."""
    encodings = ', '.join(sorted(stream.encodings))
    if len(stream.sizes) > 1:
        sizes = ', '.join(f'{w} x {h}' for w, h in sorted(stream.sizes))
        yield Finding(ERROR, topic, f'{topic} changes its size ({sizes}); record one resolution')
    if len(stream.encodings) > 1:
        yield Finding(WARNING, topic, f'{topic} changes its encoding ({encodings}); record one')
    if stream.damage:
        yield Finding(ERROR, topic, f'{topic}: {len(stream.damage)} of {stream.count} images '
                      f'cannot be read: {stream.damage[0]}')
    yield from _check_readings(topic, stream)
    yield from _check_unit(topic, stream)
    yield from _check_stamps(topic, stream)
    if not known.reliable and stream.count > 1:
        yield Finding(WARNING, topic, f'{topic} was recorded from a best-effort publisher, so '
                      'images may be missing; configure the driver to publish reliably')
    if stream.readings and not stream.damage:
        (w, h), = list(stream.sizes)[:1]
        yield Finding(OK, topic, f'{topic}: {stream.count} images, {w} x {h}, {encodings}, '
                      f'readings in {np.median(stream.readings):.0%} of the pixels')


def _check_readings(topic: str, stream: DepthStream) -> Iterator[Finding]:
    """Yield whether too few pixels have a reading."""
    if not stream.readings:
        return
    if max(stream.readings) == 0:
        yield Finding(ERROR, topic, f'{topic} holds no reading at all (every pixel is 0 or NaN); '
                      'check the sensor and record again')
    elif np.median(stream.readings) < FEW_READINGS:
        yield Finding(WARNING, topic, f'{topic} has readings in only '
                      f'{np.median(stream.readings):.0%} of its pixels; check exposure, distance '
                      'and interference between the cameras')


def _check_unit(topic: str, stream: DepthStream) -> Iterator[Finding]:
    """Yield whether the depth seems to be in another unit than its encoding says."""
    if stream.units:
        yield Finding(ERROR, topic, f'{topic}: {stream.units[0]}')


def _check_stamps(topic: str, stream: DepthStream) -> Iterator[Finding]:
    """Yield problems of the header stamps of one topic."""
    stamps = stream.stamps
    if stamps and max(stamps) == 0:
        yield Finding(ERROR, topic, f'{topic} has no header stamps (all are 0), so the images '
                      'of several cameras cannot be matched; configure the driver to stamp them')
    elif np.any(np.diff(stamps) < 0):
        yield Finding(WARNING, topic, f'the stamps of {topic} go back in time, as in bags that '
                      'were joined; record again or cut the bag there')
    elif np.any(np.diff(stamps) == 0):
        yield Finding(WARNING, topic, f'two images of {topic} have the same stamp; '
                      'fix the driver')
    if stamps and 0 < max(stamps) < EPOCH_S and np.median(stream.lags) > EPOCH_S:
        yield Finding(WARNING, topic, f'the stamps of {topic} begin at {min(stamps):.4g} s, as '
                      'those of a simulator do, so live nodes need use_sim_time:=true and /clock '
                      '("ros2 bag play --clock"); hooc replay and hooc run stamp anew')
        return
    lag = float(np.median(stream.lags)) if stream.lags else 0.0
    if abs(lag) > MAX_LAG_S and any(stamps):
        yield Finding(WARNING, topic, f'the stamps of {topic} lie {abs(lag):.3g} s '
                      f'{"before" if lag > 0 else "after"} the clock of the recorder, so live '
                      'nodes would drop the images; synchronise the clocks of the computers')


def check_synchrony(stamps: Mapping[str, Sequence[float]]) -> Iterator[Finding]:
    """
    Yield what prevents images of several cameras from forming frame sets.

    :param stamps: {camera: header stamps, s}.
    """
    if len(stamps) < 2 or not all(stamps.values()):
        return
    ends = {name: max(values) for name, values in stamps.items()}
    last = max(ends, key=lambda name: ends[name])
    first = min(ends, key=lambda name: ends[name])
    if ends[last] - ends[first] > MAX_SPREAD_S:
        yield Finding(WARNING, first, f'its images end {ends[last] - ends[first]:.3g} s before '
                      f'those of {last}, so later images form no frame set; check whether the '
                      'camera or the recorder failed')
    reference_name = min(stamps, key=lambda name: len(stamps[name]))
    reference = np.array(stamps[reference_name])
    complete = np.ones(len(reference), bool)
    for name, values in stamps.items():
        away = np.abs(np.array(values)[None, :] - reference[:, None]).min(axis=1)
        complete &= away <= MAX_SPREAD_S
        if np.median(away) > MAX_SPREAD_S:
            yield Finding(ERROR, name, f'its stamps are {np.median(away):.3g} s away from those '
                          f'of {reference_name}; synchronise the clocks of the computers')
    if complete.all():
        yield Finding(OK, 'frame sets', f'{len(reference)}, all of them complete')
    elif complete.any():
        yield Finding(WARNING, 'frame sets', f'only {complete.sum()} of {len(reference)} are '
                      f'complete within {MAX_SPREAD_S:g} s; lower the frame rate or record '
                      'reliably')
    else:
        yield Finding(ERROR, 'frame sets', 'no moment is seen by all cameras within '
                      f'{MAX_SPREAD_S:g} s; record all of them at the same time')


def check_latched(known: Mapping[str, BagTopic]) -> Iterator[Finding]:
    """Yield a Finding for each topic of transforms that a late subscriber would miss."""
    for name, topic in known.items():
        if (name == '/tf_static' or name.endswith('/extrinsics')) and not topic.latched:
            yield Finding(WARNING, name, f'{name} was recorded without transient-local '
                          'durability, so players other than hooc replay send it only once; '
                          'record it with the QoS of its publisher')

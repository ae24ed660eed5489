# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Check a bag: everything that would keep the chain from parsing it, or make it parse worse."""

from collections import defaultdict
from dataclasses import dataclass, field

from hooc_perception.core.classification.classify import KIND_PAPER
from hooc_perception.core.segment.checks import rig_trouble
from hooc_perception.core.segment.config import ObserveConfig
from hooc_perception.core.segment.observe import observe
from hooc_perception.core.segment.rectify import rectify
from hooc_perception.diagnosis.finding import ERROR, Finding, OK, WARNING
from hooc_perception.errors import HoocError
from hooc_perception.io.bags.camera_topics import camera_from_info, depth_topics
from hooc_perception.io.bags.files import iter_messages, topics
from hooc_perception.io.bags.reader import BagScene
from hooc_perception.io.bags.salvage import salvaged
from hooc_perception.io.depth_encodings import decode_depth, NEAREST_M
import numpy as np

IMAGE, INFO = 'sensor_msgs/msg/Image', 'sensor_msgs/msg/CameraInfo'
# As the ingestion node assembles frame sets.
MAX_SPREAD_S = 0.1
# As the ingestion node drops frames: max_frame_age_s.
MAX_LAG_S = 1.0
FEW_READINGS = 0.2
# Farther than any depth camera sees; more means another unit.
FARTHEST_M = 30.0
SHIFTED_M, TILTED_DEG = 0.01, 1.0
MIN_FOREGROUND = 200


@dataclass
class DepthStream:
    """What was seen of one depth topic: sizes, stamps and their lags (s), readings, damage."""

    count: int = 0
    sizes: set = field(default_factory=set)
    encodings: set = field(default_factory=set)
    stamps: list = field(default_factory=list)
    readings: list = field(default_factory=list)
    medians: list = field(default_factory=list)
    damage: list = field(default_factory=list)
    lags: list = field(default_factory=list)


def check_bag(path):
    """Yield a Finding for each check of the bag at `path`."""
    try:
        known = topics(path)
        firsts, infos, streams = read_streams(path, known)
    except HoocError as error:
        yield Finding(ERROR, 'bag', str(error))
        yield from check_remains(path)
        return
    yield Finding(OK, 'bag', f'{sum(t.count for t in known.values())} messages on '
                  f'{len(known)} topics')
    try:
        cameras = depth_topics(firsts, path)
    except HoocError as error:
        yield Finding(ERROR, 'cameras', str(error))
        return
    sound = True
    for name, topic in cameras.items():
        for finding in check_stream(topic, streams[topic], known[topic]):
            sound &= finding.level != ERROR
            yield Finding(finding.level, name, finding.text)
        try:
            camera_from_info(name, topic, infos, firsts[topic], path)
        except HoocError as error:
            sound = False
            yield Finding(ERROR, name, str(error))
    yield from check_synchrony({name: streams[topic].stamps for name, topic in cameras.items()})
    yield from check_latched(known)
    if sound:
        yield from check_geometry(path)


def check_remains(path):
    """Yield what can still be read of a damaged bag."""
    try:
        found = salvaged(path, keep=False)
    except HoocError as error:
        yield Finding(ERROR, 'salvage', str(error))
        return
    for note in list(dict.fromkeys(found.notes))[:5]:
        yield Finding(WARNING, 'damage', f'{note}; copy the bag again if there is another copy')
    if found.counts:
        yield Finding(WARNING, 'salvage', f'{found.counts.total()} messages, '
                      f'{found.counts[IMAGE]} of them images, can still be read; save them with '
                      '--salvage NEW_BAG')
    else:
        yield Finding(ERROR, 'salvage', 'no message can be read any more; record again')


def check_rig(path, model):
    """Yield whether the cameras of a bag are those that a ModelFolder was trained for."""
    try:
        cameras = BagScene(path).cameras
    except HoocError:
        return      # said already
    view_bound = np.array_equal(model.classifier.get('kind'), KIND_PAPER)
    trouble = rig_trouble(cameras, model.cameras) if view_bound else None
    yield Finding(WARNING if trouble else OK, 'model',
                  trouble or f'{model.name} can be used with these {len(cameras)} cameras')


def read_streams(path, known):
    """
    Read every depth image once.

    :param known: {topic: BagTopic}.
    :return: ({topic: first Image}, {topic: first CameraInfo}, {topic: DepthStream}).
    """
    firsts, infos, streams = {}, {}, defaultdict(DepthStream)
    wanted = {name for name, topic in known.items() if topic.type_name in (IMAGE, INFO)}
    for message in iter_messages(path, wanted):
        name = message.topic.name
        if message.topic.type_name == INFO:
            if name not in infos:
                infos[name] = message.read(path)
            continue
        stream = streams[name]
        stream.count += 1
        try:
            image = message.read(path)
        except HoocError as error:
            stream.damage.append(str(error))
            continue
        firsts.setdefault(name, image)
        if 'depth' in name.lower() or image.encoding in ('16UC1', '32FC1', 'mono16'):
            _note(stream, image)
            stream.lags.append(message.time_ns * 1e-9 - stream.stamps[-1])
    return firsts, infos, streams


def _note(stream, image):
    """Add what one image says to its DepthStream."""
    stream.sizes.add((image.width, image.height))
    stream.encodings.add(image.encoding)
    stream.stamps.append(image.header.stamp.sec + image.header.stamp.nanosec * 1e-9)
    try:
        depth = decode_depth(image.data, image.height, image.width, image.encoding, image.step,
                             image.is_bigendian)
    except HoocError as error:
        stream.damage.append(str(error))
        return
    seen = np.isfinite(depth)
    stream.readings.append(float(seen.mean()))
    if seen.any():
        stream.medians.append(float(np.median(depth[seen])))


def check_stream(topic, stream, known):
    """Yield a Finding for each check of one depth topic (name, DepthStream, BagTopic)."""
    encodings = ', '.join(sorted(stream.encodings))
    if len(stream.sizes) > 1:
        sizes = ', '.join(f'{w} x {h}' for w, h in sorted(stream.sizes))
        yield Finding(ERROR, topic, f'{topic} changes its size ({sizes}); record one resolution')
    if len(stream.encodings) > 1:
        yield Finding(WARNING, topic, f'{topic} changes its encoding ({encodings}); record one')
    if stream.damage:
        yield Finding(ERROR, topic, f'{topic}: {len(stream.damage)} of {stream.count} images '
                      f'cannot be read: {stream.damage[0]}')
    if stream.readings and max(stream.readings) == 0:
        yield Finding(ERROR, topic, f'{topic} holds no reading at all (every pixel is 0 or NaN); '
                      'check the sensor and record again')
    elif stream.readings and np.median(stream.readings) < FEW_READINGS:
        yield Finding(WARNING, topic, f'{topic} has readings in only '
                      f'{np.median(stream.readings):.0%} of its pixels; check exposure, distance '
                      'and interference between the cameras')
    if stream.medians and np.median(stream.medians) > FARTHEST_M:
        unit = 'millimetres as 32FC1' if '32FC1' in stream.encodings else 'a finer unit as 16UC1'
        yield Finding(ERROR, topic, f'{topic} sees things {np.median(stream.medians):.0f} m away, '
                      f'so it seems to hold {unit}; publish 16UC1 in millimetres or 32FC1 in '
                      'metres')
    if stream.medians and np.median(stream.medians) < NEAREST_M:
        yield Finding(ERROR, topic, f'{topic} sees things {1000 * np.median(stream.medians):.2g} '
                      f'mm away, so {encodings} seems to hold metres or centimetres; publish '
                      '16UC1 in millimetres or 32FC1 in metres')
    yield from _check_stamps(topic, stream.stamps)
    lag = float(np.median(stream.lags)) if stream.lags else 0.0
    if abs(lag) > MAX_LAG_S and any(stream.stamps):
        yield Finding(WARNING, topic, f'the stamps of {topic} lie {abs(lag):.3g} s '
                      f'{"before" if lag > 0 else "after"} the clock of the recorder, so live '
                      'nodes would drop the images; synchronise the clocks of the computers')
    if not known.reliable and stream.count > 1:
        yield Finding(WARNING, topic, f'{topic} was recorded from a best-effort publisher, so '
                      'images may be missing; let the driver publish reliably')
    if stream.readings and not stream.damage:
        (w, h), = list(stream.sizes)[:1]
        yield Finding(OK, topic, f'{topic}: {stream.count} images, {w} x {h}, {encodings}, '
                      f'readings in {np.median(stream.readings):.0%} of the pixels')


def _check_stamps(topic, stamps):
    """Yield what is wrong with the header stamps (s) of one topic."""
    if stamps and max(stamps) == 0:
        yield Finding(ERROR, topic, f'{topic} has no header stamps (all are 0), so the images '
                      'of several cameras cannot be matched; let the driver stamp them')
    elif np.any(np.diff(stamps) < 0):
        yield Finding(WARNING, topic, f'the stamps of {topic} go back in time, as in bags that '
                      'were joined; record again or cut the bag there')
    elif np.any(np.diff(stamps) == 0):
        yield Finding(WARNING, topic, f'two images of {topic} have the same stamp; '
                      'correct the driver')


def check_synchrony(stamps):
    """
    Yield what keeps images of several cameras from forming frame sets.

    :param stamps: {camera: list of header stamps, s}.
    """
    if len(stamps) < 2 or not all(stamps.values()):
        return
    ends = {name: max(values) for name, values in stamps.items()}
    last, first = max(ends, key=ends.get), min(ends, key=ends.get)
    if ends[last] - ends[first] > MAX_SPREAD_S:
        yield Finding(WARNING, first, f'its images end {ends[last] - ends[first]:.3g} s before '
                      f'those of {last}, so what comes after is in no frame set; look whether '
                      'the camera or the recorder failed')
    reference_name, reference = min(stamps.items(), key=lambda item: len(item[1]))
    reference = np.array(reference)
    whole = np.ones(len(reference), bool)
    for name, values in stamps.items():
        away = np.abs(np.array(values)[None, :] - reference[:, None]).min(axis=1)
        whole &= away <= MAX_SPREAD_S
        if np.median(away) > MAX_SPREAD_S:
            yield Finding(ERROR, name, f'its stamps are {np.median(away):.3g} s away from those '
                          f'of {reference_name}; synchronise the clocks of the computers')
    if whole.all():
        yield Finding(OK, 'frame sets', f'{len(reference)}, all of them whole')
    elif whole.any():
        yield Finding(WARNING, 'frame sets', f'only {whole.sum()} of {len(reference)} are whole '
                      f'within {MAX_SPREAD_S:g} s; lower the frame rate or record reliably')
    else:
        yield Finding(ERROR, 'frame sets', 'no moment is seen by all cameras within '
                      f'{MAX_SPREAD_S:g} s; record all of them at the same time')


def check_latched(known):
    """Yield a Finding for transforms that a late subscriber would miss."""
    for name, topic in known.items():
        if (name == '/tf_static' or name.endswith('/extrinsics')) and not topic.latched:
            yield Finding(WARNING, name, f'{name} was recorded without transient-local '
                          'durability, so players other than ours send it only once; record '
                          'with its QoS')


def check_geometry(path, config=ObserveConfig()):
    """Yield what the calibration does to the picture: poses, the table, what stands on it."""
    try:
        bag = BagScene(path)
        if bag.incomplete:
            yield Finding(WARNING, 'cameras', bag.incomplete)
        if not bag.table_known:
            yield Finding(WARNING, 'world frame', 'no frame is known to be the table, so it is '
                          'estimated from the depth; publish a frame called "table" on '
                          '/tf_static with z up and z = 0 on its top')
        rectified = [rectify(view, config) for view in bag.views()]
        observation = observe(rectified, config)
    except HoocError as error:
        yield Finding(ERROR, 'geometry', str(error))
        return
    for before, after in zip(rectified, observation.views):
        yield check_view(before.camera, after, config)
    noise_mm = 1000 * observation.noise_m
    if noise_mm > 10:
        yield Finding(WARNING, 'table', f'its measured heights scatter by {noise_mm:.1f} mm, so '
                      'flat things are lost; check the sensors, or whether the table is flat')
    else:
        yield Finding(OK, 'table', f'its measured heights scatter by {noise_mm:.1f} mm')


def check_view(camera, view, config):
    """Return the Finding on one camera's pose (Camera before, ObservedView after levelling)."""
    T_moved = view.camera.T_world_camera @ np.linalg.inv(camera.T_world_camera)
    shift_mm = 1000 * abs(T_moved[2, 3])
    tilt_deg = np.degrees(np.arccos(np.clip(T_moved[2, 2], -1, 1)))
    T = camera.T_world_camera
    name = camera.name
    if T[2, 3] <= 0:
        return Finding(ERROR, name, f'its pose lies {-T[2, 3]:.2f} m below the table; the '
                       'transform may be inverted (wanted: camera to world, z up)')
    if not view.table.any():
        return Finding(ERROR, name, 'it does not look at the table; check that its extrinsics '
                       'belong to the optical frame (x right, y down, z forward)')
    if view.foreground.sum() < MIN_FOREGROUND:
        return Finding(WARNING, name, f'it sees nothing within {config.workspace_radius_m:g} m '
                       'of the world origin that stands on the table; check the world frame')
    foreground = f'{int(view.foreground.sum())} pixels show what stands on the table'
    if shift_mm > 1000 * SHIFTED_M or tilt_deg > TILTED_DEG:
        return Finding(WARNING, name, f'its pose is {shift_mm:.0f} mm and {tilt_deg:.1f} degrees '
                       f'off the table that it sees (corrected); calibrate it again')
    return Finding(OK, name, f'{foreground}; its pose fits the table within {shift_mm:.0f} mm '
                   f'and {tilt_deg:.1f} degrees')

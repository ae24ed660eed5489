# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The topics views/*: rectified frame sets, from ingestion to the later nodes, bit for bit."""

from contextlib import contextmanager
import time

from geometry_msgs.msg import TransformStamped
from hooc_perception.chain import TOPICS
from hooc_perception.core.geometry import back_project, pose_from_matrix
from hooc_perception.core.segment.observe import observe
from hooc_perception.core.types import RectifiedView
from hooc_perception.errors import HoocError
from hooc_perception.ros.health.upstream import Upstream
from hooc_perception.ros.inputs.stamp_join import StampJoin
from hooc_perception.ros.messages.conversions import (
    camera_from_messages,
    camera_info_message,
    depth_from_message,
    depth_message,
    header,
    labels_message,
    nanoseconds,
    transform_message,
)
from hooc_perception.ros.messages.stages import points_message
import numpy as np
from sensor_msgs.msg import CameraInfo, Image, PointCloud2
from std_msgs.msg import Header

EXPLAIN_AFTER_S = 3.0
_KINDS = (('camera_info', CameraInfo), ('extrinsics', TransformStamped), ('depth_rect', Image))


class ViewOutput:
    """Publish rectified views, all with the stamp of their set."""

    def __init__(self, node, names):
        """Create the publishers on a StageNode."""
        self._publishers = {name: [node.publisher(kind, f'views/<camera>/{suffix}',
                                                  f'views/{name}/{suffix}')
                                   for suffix, kind in _KINDS] for name in names}
        self._points = node.publisher(PointCloud2, 'views/points')
        self._counts = {name: node.publisher(Image, 'views/<camera>/count', f'views/{name}/count')
                        for name in names}

    def publish(self, stamp_ns, target_frame, views, frames, counts=()):
        """
        Publish one frame set.

        :param views: RectifiedView a camera.
        :param frames: frame_id of each camera's optical frame.
        :param counts: (H, W) uint8 readings that each pixel is the median of, None where
            nothing was fused.
        """
        for view, frame, count in zip(views, frames, counts):
            if count is not None:
                self._counts[view.camera.name].publish(
                    labels_message(count, header(stamp_ns, frame)))
        for view, frame in zip(views, frames):
            head = header(stamp_ns, frame)
            info, extrinsics, depth = self._publishers[view.camera.name]
            info.publish(camera_info_message(view.camera, head))
            extrinsics.publish(transform_message(*pose_from_matrix(view.camera.T_world_camera),
                                                 header(stamp_ns, target_frame), frame))
            depth.publish(depth_message(view.depth, head))
        # Ten megabytes a set: only for those who look.
        if self._points.get_subscription_count():
            self._points.publish(fused_cloud(views, header(stamp_ns, target_frame)))


def fused_cloud(views, head):
    """Return the PointCloud2 x y z camera of all readings of RectifiedViews, world frame."""
    clouds = [back_project(view.depth, view.camera).reshape(-1, 3) for view in views]
    points = np.concatenate(clouds)
    camera = np.repeat(np.arange(len(views), dtype=np.uint8), [len(c) for c in clouds])
    seen = np.isfinite(points[:, 2])
    return points_message(points[seen], head, camera[seen])


class ViewInput:
    """
    Receive rectified views, observe them, join whatever else a stage needs of the same stamp.

    The views come first and are observed at once, while earlier stages still work. Of a set that
    gets no further, `views/refused` says that no answer will come, so that nobody waits for one;
    of one that came while the node was inactive or not willing, when it is so again.

    :param stage: what the callback does, as /diagnostics calls it.
    :param others: {part: (message type, topic)} that are joined with the observation by stamp.
    :param callback: called as callback(stamp_ns, Observation, {part: message}) for each whole
        set; the part `frames` holds the frame_id of every camera. A HoocError refuses the set.
    :param willing: callable, False while the active node ignores what comes.
    """

    def __init__(self, node, names, stage, others, callback, willing=lambda: True):
        """Create the subscriptions on a StageNode that declares the stage `observe`."""
        self._node, self._names, self._stage, self._callback = node, names, stage, callback
        self._willing = willing
        self._views = StampJoin([f'{name}/{suffix}' for name in names for suffix, _ in _KINDS])
        self._whole = StampJoin(['observation', 'frames', *others])
        for name in names:
            for suffix, kind in _KINDS:
                node.subscription(kind, f'views/<camera>/{suffix}',
                                  self._taker(self._views, f'{name}/{suffix}', self._observe),
                                  f'views/{name}/{suffix}')
        for part, (kind, topic) in others.items():
            node.subscription(kind, topic, self._taker(self._whole, part, self._deliver))
        self._refused = node.publisher(Header, 'views/refused')
        self._ignored = None        # stamp of the last set that was ignored
        self._observed = None       # monotonic s since which views wait for the other parts
        topics = [topic for _, topic in others.values()]
        self._needed = {**{f'views/{name}/depth_rect': 'views/<camera>/depth_rect'
                           for name in names}, **{topic: topic for topic in topics}}
        self._upstream = Upstream(node, topics)
        self.wait()
        node.steady_timer(1.0, self._on_timer)

    def clear(self):
        """Forget what waits."""
        self._views.clear()
        self._whole.clear()
        self._observed = None

    def wait(self):
        """Say that the stage has nothing to do yet."""
        self._node.diagnostics.state(self._stage, 'waiting', 'waits for the first frame set')

    def refuse(self, stamp_ns):
        """Say that a frame set will not be answered."""
        self._refused.publish(header(stamp_ns, self._node.config.target_frame))

    def resume(self):
        """Say of the last set that was ignored that it will not be answered, once willing."""
        if self._ignored is not None and self._node.active and self._willing():
            self.refuse(self._ignored)
            self._ignored = None

    def _on_timer(self):
        self.resume()
        if self._node.active and time.monotonic() - self._node.since > EXPLAIN_AFTER_S:
            self._explain()
            if self._observed and time.monotonic() - self._observed > EXPLAIN_AFTER_S:
                self._upstream.ask()

    def _explain(self):
        """Say which node is missing, or works for other cameras."""
        node = self._node
        silent = [topic for topic in self._needed if not node.count_publishers(topic)]
        if not silent:
            return
        makers = dict.fromkeys(TOPICS[self._needed[topic]].publisher for topic in silent)
        sentence = (f'nobody publishes {", ".join(map(node.resolve_topic_name, silent))}, so '
                    f'nothing can be done; start {" and ".join(makers)}')
        if silent[0].startswith('views/'):
            sentence += (', with the same parameter cameras in every node (here: '
                         f'{", ".join(self._names)})')
        node.diagnostics.warn('input', 'no_publisher', sentence)

    def _taker(self, join, part, then):
        def take(message):
            self._add(join, part, nanoseconds(message.header.stamp), message, then)
        return take

    def _add(self, join, part, stamp_ns, value, then):
        before = sum(join.drops.values())
        whole = join.add(part, stamp_ns, value)
        dropped = sum(join.drops.values()) - before
        if dropped:
            self._node.diagnostics.count('input', 'incomplete', dropped)
        if whole and self._node.active and self._willing():
            then(stamp_ns, whole)
        elif whole:
            # Said when the node is willing again: until then nobody need work for it.
            self._ignored = stamp_ns
            self._node.diagnostics.count('input', 'ignored')

    @contextmanager
    def _refusing(self, stamp_ns, thing):
        """Refuse the frame set where something is raised; a HoocError is trouble of `thing`."""
        try:
            yield
        except HoocError as error:
            self._node.diagnostics.error(thing, 'refused', str(error))
            self.refuse(stamp_ns)
        except Exception:
            self.refuse(stamp_ns)
            raise

    def _observe(self, stamp_ns, parts):
        frames = {name: parts[f'{name}/depth_rect'].header.frame_id for name in self._names}
        with self._refusing(stamp_ns, 'views'):
            self._check_frame(parts)
            views = tuple(RectifiedView(
                camera_from_messages(name, parts[f'{name}/camera_info'],
                                     parts[f'{name}/extrinsics']),
                depth_from_message(parts[f'{name}/depth_rect'])) for name in self._names)
            observation = observe(views, self._node.parameters['observe'])
            self._node.diagnostics.ok('views')
            self._observed = self._observed or time.monotonic()
            self._add(self._whole, 'frames', stamp_ns, frames, self._deliver)
            self._add(self._whole, 'observation', stamp_ns, observation, self._deliver)

    def _check_frame(self, parts):
        """Raise HoocError where the views are in another frame than the results would say."""
        mine = self._node.config.target_frame
        for name in self._names:
            theirs = parts[f'{name}/extrinsics'].header.frame_id
            if theirs != mine:
                raise HoocError(
                    f'the views of {name} are in the frame {theirs!r}, but target_frame of '
                    f'{self._node.get_name()} is {mine!r}; set target_frame alike in all nodes')

    def _deliver(self, stamp_ns, parts):
        self._observed = None
        self._upstream.forget()
        self._node.diagnostics.ok('input')
        with self._refusing(stamp_ns, self._stage):
            self._callback(stamp_ns, parts['observation'], parts)

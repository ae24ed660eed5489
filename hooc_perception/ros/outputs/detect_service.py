# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The service `detect`: what stands there now, not when it was last looked at."""

from dataclasses import dataclass
import json
import math
import time

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.task import Future
from std_srvs.srv import Trigger


@dataclass
class _Call:
    """Somebody who waits: since when by the node's clock, until when by the steady one."""

    called_ns: int
    deadline: float
    future: Future


class DetectService:
    """
    Answer each call with the first frame set that is newer than the call.

    The callback is a coroutine in a group of its own: while it waits, the node works on. The
    deadline is kept by the steady clock: simulated time may stand still.

    The service lives as long as its node, in every lifecycle state: who waits is answered after
    the transition that ended the waiting, and who calls a node that is not active learns it.

    :param refusal: callable that returns why no answer of the active node can come, or None.
    """

    def __init__(self, node, refusal=lambda: None):
        """Offer `detect` on a StageNode whose config has detect_timeout_s."""
        self._node, self._refusal = node, refusal
        self._waiting, self._last_ns = [], None
        node.create_service(Trigger, 'detect', self._on_call,
                            callback_group=ReentrantCallbackGroup())
        node.create_timer(0.2, self._give_up, clock=Clock(clock_type=ClockType.STEADY_TIME))

    async def _on_call(self, request, response):
        reason = self._refusal() if self._node.active else 'the node is not active: activate it'
        if reason:
            response.success, response.message = False, refusal_json(reason)
            return response
        call = _Call(self._node.now_ns(),
                     time.monotonic() + self._node.config.detect_timeout_s, Future())
        self._waiting.append(call)
        response.success, response.message = await call.future
        return response

    def answer(self, scene):
        """Reply with a DetectedScene to everybody who called before its frame set was taken."""
        if self._last_ns is not None and scene.stamp_ns < self._last_ns:
            for call in self._waiting:      # time was set back: all that comes now is newer
                call.called_ns = scene.stamp_ns - 1
        self._last_ns = scene.stamp_ns
        served = [call for call in self._waiting if call.called_ns < scene.stamp_ns]
        if served:
            text = scene_json(scene)
            for call in served:
                self._waiting.remove(call)
                call.future.set_result((True, text))

    def fail(self, reason):
        """Tell everybody who waits that no answer will come."""
        while self._waiting:
            self._waiting.pop().future.set_result((False, refusal_json(reason)))

    def forget(self):
        """Forget when the last frame set was taken."""
        self._last_ns = None

    def _give_up(self):
        now = time.monotonic()
        for call in [c for c in self._waiting if c.deadline < now]:
            self._waiting.remove(call)
            call.future.set_result((False, refusal_json(self._complaint(call))))

    def _complaint(self, call):
        text = 'no frame set newer than the call was parsed in time: '
        if self._last_ns is None:
            return text + 'none was at all; look at /diagnostics for cameras that do not deliver'
        age_s = (call.called_ns - self._last_ns) * 1e-9
        return text + (f'the last one was taken {age_s:.1f} s before; look at /diagnostics for '
                       'cameras that do not deliver, and set use_sim_time where a bag keeps its '
                       'own stamps')


def refusal_json(reason):
    """Return the JSON that `detect` answers where there is no scene to tell of."""
    return json.dumps({'error': reason})


def scene_json(scene):
    """Return the JSON of a DetectedScene, as `detect` answers."""
    return json.dumps({
        'stamp_ns': scene.stamp_ns, 'frame': scene.frame,
        'objects': [{'id': o.id, 'category': o.category, 'score': o.score,
                     'translation': o.translation.tolist(),
                     'rotation_xyzw': o.rotation_xyzw.tolist(), 'size': o.size.tolist(),
                     'sigma_t': _or_none(o.sigma_t), 'sigma_r': _or_none(o.sigma_r)}
                    for o in scene.objects]})


def _or_none(value):
    return value if math.isfinite(value) else None      # JSON knows no NaN

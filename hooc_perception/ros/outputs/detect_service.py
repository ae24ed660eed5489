# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The service `detect`: the objects as they are now, not as of the last result."""

from collections.abc import Callable
from dataclasses import dataclass
import json
import math
import time

from hooc_perception.ros.lifecycle.stage_node import StageNode
from hooc_perception.ros.outputs.detected import DetectedScene
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.task import Future
from std_srvs.srv import Trigger


@dataclass
class _Call:
    """
    A pending call.

    :ivar called_ns: when it came, by the clock of the node.
    :ivar deadline: time.monotonic() until which it waits.
    """

    called_ns: int
    deadline: float
    future: Future


class DetectService:
    """
    Answer each call with the result of the first frame set that is newer than the call.

    The callback is a coroutine in a group of its own, so that the node keeps working while it
    waits. The deadline uses the steady clock, because simulated time may stand still.

    The service lives as long as its node, in every lifecycle state: pending calls are answered
    after the transition that ended the wait, and calls to an inactive node fail at once.

    :param node: a StageNode whose config has detect_timeout_s.
    :param refusal: returns why the active node cannot produce a result, or None.
    """

    def __init__(self, node: StageNode, refusal: Callable[[], str | None] = lambda: None) -> None:
        """Offer `detect`."""
        self._node, self._refusal = node, refusal
        self._waiting: list[_Call] = []
        self._last_ns: int | None = None    # stamp of the last frame set
        # rclpy awaits coroutines, though its annotation of callbacks does not say so.
        node.create_service(Trigger, 'detect',
                            self._on_call,      # pyright: ignore[reportArgumentType]
                            callback_group=ReentrantCallbackGroup())
        node.create_timer(0.2, self._give_up, clock=Clock(clock_type=ClockType.STEADY_TIME))

    @property
    def is_waited_for(self) -> bool:
        """Return whether somebody waits for an answer."""
        return bool(self._waiting)

    async def _on_call(self, request: Trigger.Request,
                       response: Trigger.Response) -> Trigger.Response:
        reason = self._refusal() if self._node.active else 'the node is not active: activate it'
        if reason:
            response.success, response.message = False, refusal_json(reason)
            return response
        call = _Call(self._node.now_ns(),
                     time.monotonic() + self._node.config.detect_timeout_s, Future())
        self._waiting.append(call)
        # Without annotations, rclpy's futures look as if they returned None.
        success, text = await call.future       # pyright: ignore[reportGeneralTypeIssues]
        response.success, response.message = success, text
        return response

    def answer(self, scene: DetectedScene) -> None:
        """Answer all calls that are older than the frame set of this result."""
        if self._last_ns is not None and scene.stamp_ns < self._last_ns:
            for call in self._waiting:      # time was set back: any frame set is newer now
                call.called_ns = scene.stamp_ns - 1
        self._last_ns = scene.stamp_ns
        served = [call for call in self._waiting if call.called_ns < scene.stamp_ns]
        if served:
            text = scene_json(scene)
            for call in served:
                self._waiting.remove(call)
                call.future.set_result((True, text))

    def fail(self, reason: str) -> None:
        """Fail all pending calls."""
        while self._waiting:
            self._waiting.pop().future.set_result((False, refusal_json(reason)))

    def forget(self) -> None:
        """Forget the stamp of the last frame set."""
        self._last_ns = None

    def _give_up(self) -> None:
        now = time.monotonic()
        for call in [c for c in self._waiting if c.deadline < now]:
            self._waiting.remove(call)
            call.future.set_result((False, refusal_json(self._complaint(call))))

    def _complaint(self, call: _Call) -> str:
        text = 'no frame set newer than the call was parsed in time: '
        if self._last_ns is None:
            return text + 'there was none at all; check /diagnostics for silent cameras'
        age_s = (call.called_ns - self._last_ns) * 1e-9
        return text + (f'the last one was taken {age_s:.1f} s before; check /diagnostics for '
                       'silent cameras, and set use_sim_time if a bag keeps its own stamps')


def refusal_json(reason: str) -> str:
    """Return the JSON that `detect` answers if there is no result."""
    return json.dumps({'error': reason})


def scene_json(scene: DetectedScene) -> str:
    """Return the JSON of a result, as `detect` answers."""
    return json.dumps({
        'stamp_ns': scene.stamp_ns, 'frame': scene.frame,
        'objects': [{'id': o.id, 'category': o.category, 'member': o.member, 'score': o.score,
                     'translation': o.translation.tolist(),
                     'rotation_xyzw': o.rotation_xyzw.tolist(), 'size': o.size.tolist(),
                     'sigma_t': _or_none(o.sigma_t), 'sigma_r': _or_none(o.sigma_r),
                     'hidden_s': o.hidden_s}
                    for o in scene.objects],
        'unknown': [{'id': u.id, 'score': _or_none(u.score), 'translation': u.translation.tolist(),
                     'rotation_xyzw': u.rotation_xyzw.tolist(), 'size': u.size.tolist()}
                    for u in scene.unknown]})


def _or_none(value: float) -> float | None:
    return value if math.isfinite(value) else None      # JSON has no NaN

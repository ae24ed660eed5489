# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The service `detect`: what stands there now, not when it was last looked at."""

import json

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.task import Future
from std_srvs.srv import Trigger


class DetectService:
    """
    Answer each call with the first frame set that is newer than the call.

    The callback is a coroutine in a group of its own: while it waits, the node works on.
    """

    def __init__(self, node):
        """Offer `detect` on a StageNode whose config has detect_timeout_s."""
        self._node, self._waiting = node, []    # [(called ns, give up ns, Future)]
        node.owned(node.destroy_service, node.create_service(
            Trigger, 'detect', self._on_call, callback_group=ReentrantCallbackGroup()))
        node.owned(node.destroy_timer, node.create_timer(0.2, self._give_up))
        node.owned(lambda _: self._fail_all('the node is being cleaned up'), None)

    async def _on_call(self, request, response):
        if not self._node.active:
            response.success, response.message = False, 'the node is not active: activate it'
            return response
        now = self._node.now_ns()
        future = Future()
        self._waiting.append(
            (now, now + int(self._node.config.detect_timeout_s * 1e9), future))
        response.success, response.message = await future
        return response

    def answer(self, stamp_ns, parsed, ids, models):
        """Reply to everybody who called before the frame set was taken."""
        text = json.dumps({'stamp_ns': stamp_ns, 'frame': self._node.config.target_frame,
                           'objects': described(parsed, ids, models)})
        for entry in [w for w in self._waiting if w[0] < stamp_ns]:
            self._waiting.remove(entry)
            entry[2].set_result((True, text))

    def _give_up(self):
        now = self._node.now_ns()
        for entry in [w for w in self._waiting if w[1] < now]:
            self._waiting.remove(entry)
            entry[2].set_result((False, 'no frame set newer than the call was parsed in time: '
                                 'look at /diagnostics for cameras that do not deliver'))

    def _fail_all(self, reason):
        while self._waiting:
            self._waiting.pop()[2].set_result((False, reason))


def described(parsed, ids, models):
    """Return the objects of a ParsedScene as a list of dicts for JSON."""
    found = parsed.objects
    return [{'id': int(ids[i]), 'category': models[int(found.category[i]) - 1].name,
             'score': float(found.score[i]), 'translation': found.translation[i].tolist(),
             'rotation_xyzw': found.rotation_xyzw[i].tolist(),
             'size': [float(x) for x in found.size[i]]} for i in range(len(found))]

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Stage 4: candidates -> the objects that together explain the frame set."""

from collections.abc import Sequence
from dataclasses import replace
import json
import sys
import time
from typing import Any

from geometry_msgs.msg import PoseArray
from hooc_perception.chain import PARSING
from hooc_perception.core.frame.frame import Frame
from hooc_perception.core.geometry import inverse
from hooc_perception.core.parsing.events import EventLog
from hooc_perception.core.parsing.hidden_objects import HiddenObjects
from hooc_perception.core.parsing.tracking import Tracker
from hooc_perception.core.parsing.unexplained import unexplained
from hooc_perception.core.types import (
    Candidates,
    GenericModel,
    Observation,
    ParsedScene,
    PixelProbabilities,
)
from hooc_perception.nodes.following import Following
from hooc_perception.nodes.leftover import Leftover
from hooc_perception.nodes.model import (
    camera_names,
    mesh_uris,
    model_of,
    node_profile,
    parser_of,
)
from hooc_perception.nodes.parsing_config import ParsingConfig
from hooc_perception.nodes.warm_up import warmed
from hooc_perception.ros.health.diagnostics import WARN
from hooc_perception.ros.inputs.view_input import ViewInput
from hooc_perception.ros.lifecycle.spin import run_node
from hooc_perception.ros.lifecycle.stage_node import StageNode
from hooc_perception.ros.messages.stages import (
    candidates_from_messages,
    probabilities_from_message,
)
from hooc_perception.ros.outputs.adapters.choose import adapters_of, clear_all, publish_all
from hooc_perception.ros.outputs.detect_service import DetectService
from hooc_perception.ros.outputs.detected import detected_scene
from hooc_perception.ros.outputs.event_output import EventOutput
from hooc_perception.ros.outputs.object_output import ObjectOutput
from sensor_msgs.msg import PointCloud2
from std_srvs.srv import SetBool, Trigger


class ParsingNode(StageNode[ParsingConfig, 'Parsing']):
    """Join everything of one stamp, parse, publish objects/*."""

    CONFIG = ParsingConfig

    def __init__(self, **kwargs: Any) -> None:
        """Declare parameters; offer `detect` in every lifecycle state."""
        super().__init__(PARSING, **kwargs)
        self.detect = DetectService(self, lambda: None if self.work.enabled else (
            'frame sets are ignored: call enable with true'))

    def configure(self) -> 'Parsing':
        """Load the generic models, build the endpoints."""
        return Parsing(self)

    def activate(self) -> None:
        """Publish what the class ids mean."""
        self.work.output.announce()

    def deactivate(self) -> None:
        """Retract the result, which nobody keeps up to date any more, and let nobody wait."""
        self.detect.fail('the node was deactivated')
        self.work.stop()

    def cleanup(self) -> None:
        """Begin anew with the next configuration."""
        self.detect.forget()


class Parsing:
    """
    The work of a configured parsing node.

    :ivar models: generic models; class id c is models[c - 1].
    :ivar enabled: whether frame sets are parsed.
    :ivar output: the topics of the result.
    :ivar adapters: forms of the result for other packages.
    """

    def __init__(self, node: ParsingNode) -> None:
        """Build everything on the node."""
        self._node, self._model = node, model_of(node)
        self.models, model, self.enabled = self._model.models, self._model, True
        limit = node.config.max_instances
        self._parser = parser_of(node, model, model.max_instances if limit < 0 else limit,
                                 node.config.sigmas)
        warmed(node, model, self._try_out)
        self._tracker = Tracker(model.models, node.config)
        self._following = Following(node.diagnostics)
        self._log, self._leftover = EventLog(model.models), Leftover(model.models)
        self._hidden = HiddenObjects(model.models, node.config, self._parser.max_instances)
        self.output = ObjectOutput(node, model.models, mesh_uris(model))
        self._events = EventOutput(node)
        self.input = ViewInput(node, camera_names(node, model), 'parse', {
            'probabilities': (PointCloud2, 'pixels/probabilities'),
            'poses': (PoseArray, 'candidates/poses'),
            'attributes': (PointCloud2, 'candidates/attributes')}, self.on_set,
            lambda: self.enabled)
        self.adapters = adapters_of(node)
        # Monotonic seconds of the result that stands; None: there is none.
        self._answered: float | None = None
        node.steady_timer(0.5, self._on_timer)
        node.service(SetBool, 'enable', self._on_enable)
        node.service(Trigger, 'reset', self._on_reset)

    def _try_out(self, observation: Observation, probabilities: PixelProbabilities,
                 candidates: Candidates, models: tuple[GenericModel, ...]) -> None:
        """Parse a synthetic scene."""
        frame = Frame(observation, probabilities, models)
        parsed = self._parser.method.parse(frame, candidates, self._node.config.seed,
                                           self._parser.max_instances)
        unexplained(observation, parsed.objects, parsed.unknown, models)

    def _parsed(self, observation: Observation, messages: dict[str, Any]) -> ParsedScene:
        """Return the ParsedScene, in the target frame, of what came together for one stamp."""
        config = self._node.config
        pool = candidates_from_messages(messages['poses'], messages['attributes'],
                                        [len(model.members) for model in self.models])
        parser = self._parser = self._parser.changed(node_profile(self._node, self._model),
                                                     config.sigmas)
        T = observation.T_target_table
        pool = pool if T is None else pool.moved(inverse(T))

        def frame() -> Frame:
            return parser.frame(observation, probabilities_from_message(
                messages['probabilities'], observation, len(self.models)))

        def candidates(seen: Frame) -> Candidates:
            # Stage 3 leaves out what it does not take to have changed.
            return pool if len(pool) else parser.propose(seen, config.seed)

        if not config.incremental:
            self._following.forget()
            return parser.decide(frame(), pool, config.seed).moved(T)
        return self._following.update(
            parser, observation, frame, candidates, config.seed, config.full_every_s,
            config.detect_full and self._node.detect.is_waited_for).moved(T)

    def on_set(self, stamp_ns: int, observation: Observation, messages: dict[str, Any]) -> None:
        """Parse one frame set and publish the result."""
        node, start = self._node, time.monotonic()
        parsed, frame = self._parsed(observation, messages), node.config.target_frame
        self._tracker.config = self._hidden.config = node.config
        ids, objects = self._tracker.update(stamp_ns, parsed.objects)
        parsed = replace(parsed, objects=objects)
        left, found = self._leftover.of(observation, objects, parsed.unknown), len(ids)
        parsed, ids = self._hidden.update(stamp_ns, parsed, ids, observation.in_target_frame())
        self._tracker.hold(ids, stamp_ns)
        events = self._log.update(ids, parsed.objects, parsed.hidden_s)
        scene = detected_scene(parsed, ids, self.models, stamp_ns, frame,
                               self._tracker.update_unknown(stamp_ns, parsed.unknown))
        age_s = (node.now_ns() - stamp_ns) * 1e-9
        self.output.publish(parsed, scene, age_s, left)
        self._events.publish(stamp_ns, events)
        self._answered = time.monotonic()
        publish_all(node, self.adapters, scene)
        node.detect.answer(scene)
        node.diagnostics.ok('parse', seconds=time.monotonic() - start, objects=len(ids),
                            hidden=len(ids) - found, age_s=age_s,
                            energy=float(parsed.energy.total))

    def stop(self) -> None:
        """Give up what runs in the background, and retract the result."""
        self._following.give_up()
        self.retract()

    def retract(self) -> None:
        """Publish that nothing is known any more; objects that return in time keep their ids."""
        self._answered = None
        self._hidden.forget()
        self._log.forget()
        self._tracker.retract()
        now = self._node.now_ns(), self._node.config.target_frame
        self.output.clear(*now)
        clear_all(self._node, self.adapters, *now)

    def _on_enable(self, request: SetBool.Request,
                   response: SetBool.Response) -> SetBool.Response:
        """Parse frame sets, or ignore them."""
        before, self.enabled = self.enabled, request.data
        if self.enabled and not before:
            self.input.wait()
            self.input.resume()
        elif not self.enabled:
            self._report_disabled()
            self._node.detect.fail('frame sets are ignored from now on')
        response.success = True
        response.message = 'parsing' if self.enabled else 'frame sets are ignored'
        return response

    def _on_reset(self, request: Trigger.Request,
                  response: Trigger.Response) -> Trigger.Response:
        """Forget what waits to be joined and what was seen; retract the last result."""
        self.input.clear()
        self._following.forget()
        self._tracker.forget()
        self._hidden.forget()
        if self._node.active:
            self.retract()
        response.success, response.message = True, json.dumps({'objects': 0})
        return response

    def _on_timer(self) -> None:
        """Retract a result that has grown old."""
        node, keep = self._node, self._node.config.keep_answer_s
        if node.active and keep and self._answered and time.monotonic() - self._answered > keep:
            node.diagnostics.warn('parse', 'answer_expired', 'no frame set has come for '
                                  f'{keep:g} s (keep_answer_s); the last result is retracted')
            self.retract()
            if not self.enabled:
                self._report_disabled()

    def _report_disabled(self) -> None:
        """Report in /diagnostics why there are no results."""
        self._node.diagnostics.state('parse', 'disabled', 'frame sets are ignored: call enable '
                                     'with true', WARN)


def main(args: Sequence[str] | None = None) -> int:
    """Run the node; return the exit code."""
    return run_node(ParsingNode, args)


if __name__ == '__main__':
    sys.exit(main())

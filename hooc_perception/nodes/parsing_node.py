# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Stage 4: candidates -> the objects that together explain the frame set."""

from dataclasses import dataclass, replace
import json
import sys
import time

from geometry_msgs.msg import PoseArray
from hooc_perception.chain import PARSING, STAGES_OF
from hooc_perception.core.config import param
from hooc_perception.core.frame.frame import Frame
from hooc_perception.core.parsing.tracking import TrackConfig, Tracker
from hooc_perception.core.parsing.unexplained import unexplained_points
from hooc_perception.core.segment.observe import observe
from hooc_perception.nodes.model import camera_names, model_of, node_profile, parser_of
from hooc_perception.nodes.warm_up import warmed
from hooc_perception.ros.health.diagnostics import WARN
from hooc_perception.ros.inputs.view_topics import ViewInput
from hooc_perception.ros.lifecycle.spin import run_node
from hooc_perception.ros.lifecycle.stage_node import StageConfig, StageNode
from hooc_perception.ros.messages.stages import (
    candidates_from_messages,
    probabilities_from_message,
)
from hooc_perception.ros.outputs.adapters.choose import AdapterConfig, adapters_of, tell
from hooc_perception.ros.outputs.detect_service import DetectService
from hooc_perception.ros.outputs.detected import detected_scene
from hooc_perception.ros.outputs.object_output import ObjectOutput
from sensor_msgs.msg import PointCloud2
from std_srvs.srv import SetBool, Trigger


@dataclass(frozen=True)
class ParsingConfig(AdapterConfig, TrackConfig, StageConfig):
    """Parameters of the parsing node."""

    max_instances: int = param(-1, 'Objects of one category in a scene at most; 0 sets no '
                               "limit, -1 takes the model's.", '', -1, 1000)
    sigmas: bool = param(True, 'Estimate sigma_t and sigma_r, for about 0.05 CPU seconds an '
                         'object.', runtime=True)
    keep_answer_s: float = param(0.0, 'An answer that no new one has followed for so long is '
                                 'taken back, as if by `reset`: nobody watches what it speaks '
                                 'of. 0 = it stays.', 's', 0.0, 86400.0, runtime=True)
    detect_timeout_s: float = param(30.0, 'The detect service gives up after this time.', 's',
                                    0.1, 600.0, runtime=True)


class ParsingNode(StageNode):
    """Join everything of one stamp, parse, publish objects/*."""

    def __init__(self, **kwargs):
        """Declare parameters."""
        super().__init__(PARSING, ParsingConfig(), STAGES_OF[PARSING], **kwargs)
        self.detect = DetectService(self, lambda: None if self.enabled else (
            'frame sets are ignored: call enable with true'))

    def configure(self):
        """Load the generic models, build the endpoints."""
        model = model_of(self)
        self.models, self.enabled = model.models, True
        limit = self.config.max_instances
        self.model = model
        self.parser = parser_of(self, model, model.max_instances if limit < 0 else limit,
                                self.config.sigmas)
        warmed(self, model, self.try_out)
        self.tracker = Tracker(model.models, self.config)
        self.output = ObjectOutput(self, model.models, [
            (model.mesh_path(m.name).resolve().as_uri(), model.mesh_sha256[m.name])
            for m in model.models])
        self.input = ViewInput(self, camera_names(self, model), 'parse', {
            'probabilities': (PointCloud2, 'pixels/probabilities'),
            'poses': (PoseArray, 'candidates/poses'),
            'attributes': (PointCloud2, 'candidates/attributes')}, self.on_set,
            lambda: self.enabled)
        self.adapters = adapters_of(self)
        self.answered = None        # monotonic s of the answer that stands, None: there is none
        self.steady_timer(0.5, self.on_timer)
        self.owned(self.destroy_service, self.create_service(SetBool, 'enable', self.on_enable))
        self.owned(self.destroy_service, self.create_service(Trigger, 'reset', self.on_reset))

    def try_out(self, views, probabilities, candidates, models):
        """Parse a made-up scene."""
        observation = observe(views, self.parameters['observe'])
        frame = Frame(observation, probabilities, models)
        parsed = self.parser.method.parse(frame, candidates, self.config.seed,
                                          self.parser.max_instances)
        unexplained_points(observation, parsed.objects, models)

    def activate(self):
        """Say what the class ids mean."""
        self.output.announce()

    def deactivate(self):
        """Take back the answer, which nobody watches any more, and let nobody wait."""
        self.detect.fail('the node was deactivated')
        self.take_back()

    def cleanup(self):
        """Begin anew with the next configuration."""
        self.detect.forget()

    def on_set(self, stamp_ns, observation, messages):
        """Parse one frame set."""
        start = time.monotonic()
        n = len(self.models)
        probabilities = probabilities_from_message(messages['probabilities'], observation, n)
        self.parser = self.parser.changed(node_profile(self, self.model), self.config.sigmas)
        parsed = self.parser.decide(
            self.parser.frame(observation, probabilities),
            candidates_from_messages(messages['poses'], messages['attributes'], n),
            self.config.seed)
        self.tracker.config = self.config
        ids, objects = self.tracker.update(stamp_ns, parsed.objects)
        parsed = replace(parsed, objects=objects)
        left = unexplained_points(observation, objects, self.models)
        scene = detected_scene(parsed, ids, self.models, stamp_ns, self.config.target_frame)
        age_s = (self.now_ns() - stamp_ns) * 1e-9
        self.output.publish(parsed, ids, stamp_ns, self.config.target_frame, age_s, left)
        self.answered = time.monotonic()
        tell(self, self.adapters, 'publish', scene)
        self.detect.answer(scene)
        self.diagnostics.ok('parse', seconds=time.monotonic() - start, objects=len(ids),
                            energy=float(parsed.energy.total), age_s=age_s)

    def on_enable(self, request, response):
        """Let frame sets be parsed, or ignore them."""
        before, self.enabled = self.enabled, request.data
        if self.enabled and not before:
            self.input.wait()
            self.input.resume()
        elif not self.enabled:
            self.say_disabled()
            self.detect.fail('frame sets are ignored from now on')
        response.success = True
        response.message = 'parsing' if self.enabled else 'frame sets are ignored'
        return response

    def on_timer(self):
        """Take back an answer that has grown old."""
        keep = self.config.keep_answer_s
        if self.active and keep and self.answered and time.monotonic() - self.answered > keep:
            self.diagnostics.warn('parse', 'answer_expired', 'no frame set has come for '
                                  f'{keep:g} s (keep_answer_s); the last answer is taken back')
            self.take_back()
            if not self.enabled:
                self.say_disabled()

    def say_disabled(self):
        """Say in /diagnostics why there are no answers."""
        self.diagnostics.state('parse', 'disabled', 'frame sets are ignored: call enable with '
                               'true', WARN)

    def on_reset(self, request, response):
        """Forget what waits to be joined and what was seen; take the last answer back."""
        self.input.clear()
        self.tracker.forget()
        if self.active:
            self.take_back()
        response.success, response.message = True, json.dumps({'objects': 0})
        return response

    def take_back(self):
        """Publish that nothing is known any more; ids stay with what returns in time."""
        self.answered = None
        now = self.now_ns(), self.config.target_frame
        self.output.clear(*now)
        tell(self, self.adapters, 'clear', *now)


def main(args=None):
    """Run the node; return the exit code."""
    return run_node(ParsingNode, args)


if __name__ == '__main__':
    sys.exit(main())

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Stage 3: class probabilities -> pose candidates of every category."""

import sys
import time

from geometry_msgs.msg import PoseArray
from hooc_perception.core.geometry import stage_rng
from hooc_perception.core.hypotheses.propose import propose
from hooc_perception.core.pipeline import proposer
from hooc_perception.core.segment.observe import observe
from hooc_perception.errors import HoocError
from hooc_perception.nodes.model import camera_names, model_of
from hooc_perception.nodes.warm_up import warmed
from hooc_perception.ros.inputs.view_topics import ViewInput
from hooc_perception.ros.lifecycle.spin import run_node
from hooc_perception.ros.lifecycle.stage_node import StageConfig, StageNode
from hooc_perception.ros.messages.conversions import header
from hooc_perception.ros.messages.stages import candidates_messages, probabilities_from_message
from hooc_perception.ros.reproposal import no_answer_messages, parsed_request, Proposers
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import String


class CandidateNode(StageNode):
    """Join views and probabilities, propose, publish candidates/*."""

    def __init__(self, **kwargs):
        """Declare parameters."""
        super().__init__('candidate_node', StageConfig(), ('observe', 'propose'), **kwargs)

    def configure(self):
        """Load the generic models, build the endpoints."""
        model = model_of(self)
        self.models = model.models
        warmed(self, model, self.try_out)
        self.proposers = Proposers()
        self.poses = self.publisher(PoseArray, 'candidates/poses')
        self.attributes = self.publisher(PointCloud2, 'candidates/attributes')
        self.more_poses = self.publisher(PoseArray, 'candidates/more/poses')
        self.more_attributes = self.publisher(PointCloud2, 'candidates/more/attributes')
        self.subscription(String, 'candidates/requests', self.on_request)
        self.input = ViewInput(self, camera_names(self, model), 'propose',
                               {'probabilities': (PointCloud2, 'pixels/probabilities')},
                               self.on_set)

    def try_out(self, views, probabilities, candidates, models):
        """Propose for a made-up scene, and once more for what its first object leaves."""
        observation = observe(views, self.parameters['observe'])
        config, seed = self.parameters['propose'], self.config.seed
        propose(observation, probabilities, models, config, stage_rng(seed, 'propose'))
        proposer(observation, probabilities, models, config, seed)(candidates.take([0]), 1)

    def on_set(self, stamp_ns, observation, messages):
        """Propose candidates for one frame set."""
        start = time.monotonic()
        probabilities = probabilities_from_message(messages['probabilities'], observation,
                                                   len(self.models))
        candidates = propose(observation, probabilities, self.models, self.parameters['propose'],
                             stage_rng(self.config.seed, 'propose'))
        self.proposers.keep(stamp_ns, proposer(observation, probabilities, self.models,
                                               self.parameters['propose'], self.config.seed))
        poses, attributes = candidates_messages(candidates,
                                                header(stamp_ns, self.config.target_frame))
        self.attributes.publish(attributes)
        self.poses.publish(poses)
        self.diagnostics.ok('propose', seconds=time.monotonic() - start,
                            candidates=len(candidates))

    def on_request(self, message):
        """Propose anew for what the objects chosen so far leave unexplained; always answer."""
        if not self.active:
            return
        try:
            stamp_ns, turn, objects = parsed_request(message.data)
        except HoocError as error:
            self.diagnostics.error('propose', 'refused', str(error))
            return
        head = header(stamp_ns, self.config.target_frame)
        poses, attributes = no_answer_messages(head, turn)
        try:
            more = self.proposers.of(stamp_ns)(objects, turn)
            poses, attributes = candidates_messages(more, head, turn)
            self.diagnostics.ok('propose', candidates_round=len(more))
        except HoocError as error:
            self.diagnostics.warn('propose', 'no_more_candidates', str(error))
        finally:
            self.more_attributes.publish(attributes)
            self.more_poses.publish(poses)


def main(args=None):
    """Run the node; return the exit code."""
    return run_node(CandidateNode, args)


if __name__ == '__main__':
    sys.exit(main())

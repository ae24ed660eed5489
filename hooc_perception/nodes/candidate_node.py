# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Stage 3: class probabilities -> pose candidates of every category."""

import sys
import time

from geometry_msgs.msg import PoseArray
from hooc_perception.chain import CANDIDATES, STAGES_OF
from hooc_perception.core.frame.frame import Frame
from hooc_perception.core.segment.observe import observe
from hooc_perception.nodes.model import camera_names, model_of, node_profile, parser_of
from hooc_perception.nodes.warm_up import warmed
from hooc_perception.ros.inputs.view_topics import ViewInput
from hooc_perception.ros.lifecycle.spin import run_node
from hooc_perception.ros.lifecycle.stage_node import StageConfig, StageNode
from hooc_perception.ros.messages.conversions import header
from hooc_perception.ros.messages.stages import candidates_messages, probabilities_from_message
from sensor_msgs.msg import PointCloud2


class CandidateNode(StageNode):
    """Join views and probabilities, propose, publish candidates/*."""

    def __init__(self, **kwargs):
        """Declare parameters."""
        super().__init__(CANDIDATES, StageConfig(), STAGES_OF[CANDIDATES], **kwargs)

    def configure(self):
        """Load the generic models, build the endpoints."""
        model = model_of(self)
        self.model, self.parser = model, parser_of(self, model)
        warmed(self, model, self.try_out)
        self.poses = self.publisher(PoseArray, 'candidates/poses')
        self.attributes = self.publisher(PointCloud2, 'candidates/attributes')
        self.input = ViewInput(self, camera_names(self, model), 'propose',
                               {'probabilities': (PointCloud2, 'pixels/probabilities')},
                               self.on_set)

    def try_out(self, views, probabilities, candidates, models):
        """Propose for a made-up scene."""
        observation = observe(views, self.parameters['observe'])
        self.parser.propose(Frame(observation, probabilities, models), self.config.seed)

    def on_set(self, stamp_ns, observation, messages):
        """Propose candidates for one frame set."""
        start = time.monotonic()
        probabilities = probabilities_from_message(messages['probabilities'], observation,
                                                   len(self.model.models))
        self.parser = self.parser.changed(node_profile(self, self.model))
        candidates = self.parser.propose(self.parser.frame(observation, probabilities),
                                         self.config.seed)
        poses, attributes = candidates_messages(candidates,
                                                header(stamp_ns, self.config.target_frame))
        self.attributes.publish(attributes)
        self.poses.publish(poses)
        self.diagnostics.ok('propose', seconds=time.monotonic() - start,
                            candidates=len(candidates))


def main(args=None):
    """Run the node; return the exit code."""
    return run_node(CandidateNode, args)


if __name__ == '__main__':
    sys.exit(main())

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Stage 3: class probabilities -> pose candidates of every category."""

from collections.abc import Sequence
import sys
import time
from typing import Any

from geometry_msgs.msg import PoseArray
from hooc_perception.chain import CANDIDATES
from hooc_perception.core.frame.frame import Frame
from hooc_perception.core.incremental.memory import Memory
from hooc_perception.core.types import Candidates, Observation
from hooc_perception.nodes.model import camera_names, model_of, node_profile, parser_of
from hooc_perception.nodes.warm_up import warmed
from hooc_perception.ros.inputs.view_input import ViewInput
from hooc_perception.ros.lifecycle.spin import run_node
from hooc_perception.ros.lifecycle.stage_config import StageConfig
from hooc_perception.ros.lifecycle.stage_node import StageNode
from hooc_perception.ros.messages.conversions import header
from hooc_perception.ros.messages.stages import candidates_messages, probabilities_from_message
from sensor_msgs.msg import PointCloud2


class CandidateNode(StageNode[StageConfig, 'Proposal']):
    """Join observations and probabilities, propose, publish candidates/*."""

    def __init__(self, **kwargs: Any) -> None:
        """Declare parameters."""
        super().__init__(CANDIDATES, **kwargs)

    def configure(self) -> 'Proposal':
        """Load the generic models, build the endpoints."""
        return Proposal(self)


class Proposal:
    """
    The work of a configured candidate node.

    :ivar models: generic models; class id c is models[c - 1].
    """

    def __init__(self, node: CandidateNode) -> None:
        """Build everything on the node."""
        self._node, self._model = node, model_of(node)
        self.models, model = self._model.models, self._model
        self._parser = parser_of(node, model)
        warmed(node, model, lambda observation, probabilities, _, models: self._parser.propose(
            Frame(observation, probabilities, models), node.config.seed))
        self._memory: Memory | None = None
        self._poses = node.publisher(PoseArray, 'candidates/poses')
        self._attributes = node.publisher(PointCloud2, 'candidates/attributes')
        self.input = ViewInput(node, camera_names(node, model), 'propose',
                               {'probabilities': (PointCloud2, 'pixels/probabilities')},
                               self._on_set)

    def _on_set(self, stamp_ns: int, observation: Observation, messages: dict[str, Any]) -> None:
        """Propose candidates for one frame set."""
        start = time.monotonic()
        self._parser = self._parser.changed(node_profile(self._node, self._model))
        candidates = Candidates.empty()
        if self._is_asked(observation):
            probabilities = probabilities_from_message(messages['probabilities'], observation,
                                                       len(self.models))
            candidates = self._parser.propose(self._parser.frame(observation, probabilities),
                                              self._node.config.seed)
        poses, attributes = candidates_messages(
            candidates.moved(observation.T_target_table),
            header(stamp_ns, self._node.config.target_frame))
        self._attributes.publish(attributes)
        self._poses.publish(poses)
        self._node.diagnostics.ok('propose', seconds=time.monotonic() - start,
                                  candidates=len(candidates))

    def _is_asked(self, observation: Observation) -> bool:
        """
        Return whether candidates are proposed for the whole scene.

        Where only a part has changed, or nothing, parsing proposes for what its objects leave
        unexplained there.
        """
        if not self._node.config.incremental:
            self._memory = None
            return True
        step = self._parser.step(self._memory, observation)
        self._memory = step.memory
        return step.full


def main(args: Sequence[str] | None = None) -> int:
    """Run the node; return the exit code."""
    return run_node(CandidateNode, args)


if __name__ == '__main__':
    sys.exit(main())

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Stage 2: observed frame sets -> class probabilities of the foreground pixels."""

from collections.abc import Sequence
import sys
import time
from typing import Any

from hooc_perception.chain import CLASSIFICATION
from hooc_perception.core.arrays import UInt8Array
from hooc_perception.core.classification.classify import KIND_PAPER
from hooc_perception.core.incremental.carry import carried
from hooc_perception.core.incremental.memory import Memory
from hooc_perception.core.segment.checks import rig_size_trouble, rig_trouble
from hooc_perception.core.types import Observation, PixelProbabilities
from hooc_perception.errors import HoocError
from hooc_perception.nodes.model import camera_names, model_of, node_profile, parser_of
from hooc_perception.nodes.warm_up import warmed
from hooc_perception.ros.inputs.view_input import ViewInput
from hooc_perception.ros.lifecycle.spin import run_node
from hooc_perception.ros.lifecycle.stage_config import StageConfig
from hooc_perception.ros.lifecycle.stage_node import StageNode
from hooc_perception.ros.messages.conversions import header, labels_message
from hooc_perception.ros.messages.stages import label_images, probabilities_message
import numpy as np
from sensor_msgs.msg import Image, PointCloud2


class ClassificationNode(StageNode[StageConfig, 'Classification']):
    """Classify, publish pixels/*."""

    def __init__(self, **kwargs: Any) -> None:
        """Declare parameters."""
        super().__init__(CLASSIFICATION, **kwargs)

    def configure(self) -> 'Classification':
        """Load the classifier, build the endpoints."""
        return Classification(self)


class Classification:
    """The work of a configured classification node."""

    def __init__(self, node: ClassificationNode) -> None:
        """Build everything on the node."""
        self._node, self._model = node, model_of(node)
        model = self._model
        self._names, self._classes = camera_names(node, model), [m.name for m in model.models]
        # The paper's forests look into all views at once, from where they were trained.
        self._trained = model.cameras if np.array_equal(
            model.classifier.get('kind', -1), KIND_PAPER) else ()
        if self._trained and (trouble := rig_size_trouble(self._names, self._trained)):
            raise HoocError(trouble)
        self._parser = parser_of(node, model)
        warmed(node, model, lambda observation, *_: self._parser.classify(observation))
        # Of the last frame set; None: the next one is classified in any case.
        self._memory: Memory | None = None
        # The observation of the last set, and what was sent for it: probabilities, label images,
        # number of pixels.
        self._sent_for: Observation | None = None
        self._sent: tuple[PointCloud2, list[UInt8Array], int]
        self._last: PixelProbabilities | None = None
        self._probabilities = node.publisher(PointCloud2, 'pixels/probabilities')
        self._labels = [
            node.publisher(Image, 'pixels/<camera>/labels', f'pixels/{name}/labels')
            for name in self._names]
        self.input = ViewInput(node, self._names, 'classify', {}, self._on_views)

    def _on_views(self, stamp_ns: int, observation: Observation,
                  messages: dict[str, Any]) -> None:
        """Classify one frame set."""
        start, diagnostics = time.monotonic(), self._node.diagnostics
        self._check_rig(observation)
        parser, self._parser = self._parser, self._parser.changed(
            node_profile(self._node, self._model))
        head = header(stamp_ns, self._node.config.target_frame)
        if (observation is self._sent_for and parser is self._parser
                and self._node.config.incremental):
            # The very same views: the messages of the last set, with another stamp.
            message, images, n = self._sent
            message.header = head
        else:
            probabilities = self._classified(observation)
            message = probabilities_message(probabilities, observation.in_target_frame(),
                                            self._classes, head)
            images, n = label_images(probabilities, observation), len(probabilities.camera)
        self._sent_for, self._sent = observation, (message, images, n)
        self._probabilities.publish(message)
        seconds = time.monotonic() - start
        for name, publisher, image in zip(self._names, self._labels, images):
            publisher.publish(labels_message(image, header(stamp_ns, messages['frames'][name])))
        diagnostics.ok('classify', seconds=seconds, pixels=n)

    def _classified(self, observation: Observation) -> PixelProbabilities:
        """Return the probabilities: those of the last frame set where nothing has changed."""
        if not self._node.config.incremental:
            self._memory = self._last = None
            return self._parser.classify(observation)
        step = self._parser.step(self._memory, observation)
        still = not step.full and step.region is None
        if still and self._last is not None:
            self._last = carried(self._last, observation)
        else:
            self._last = self._parser.classify(observation)
        self._memory = step.memory
        return self._last

    def _check_rig(self, observation: Observation) -> None:
        """Report cameras that do not stand where a view-bound classifier was trained."""
        cameras = [view.camera for view in observation.views]
        if self._trained and (trouble := rig_trouble(cameras, self._trained)):
            self._node.diagnostics.warn('model', 'other_rig', trouble)
        else:
            self._node.diagnostics.ok('model')


def main(args: Sequence[str] | None = None) -> int:
    """Run the node; return the exit code."""
    return run_node(ClassificationNode, args)


if __name__ == '__main__':
    sys.exit(main())

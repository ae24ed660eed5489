# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Stage 2: rectified frame sets -> class probabilities of the foreground pixels."""

import sys
import time

from hooc_perception.chain import CLASSIFICATION, STAGES_OF
from hooc_perception.core.classification.classify import KIND_PAPER
from hooc_perception.core.segment.checks import rig_trouble
from hooc_perception.core.segment.observe import observe
from hooc_perception.errors import HoocError
from hooc_perception.nodes.model import camera_names, model_of, node_profile, parser_of
from hooc_perception.nodes.warm_up import warmed
from hooc_perception.ros.inputs.view_topics import ViewInput
from hooc_perception.ros.lifecycle.spin import run_node
from hooc_perception.ros.lifecycle.stage_node import StageConfig, StageNode
from hooc_perception.ros.messages.conversions import header, labels_message
from hooc_perception.ros.messages.stages import label_images, probabilities_message
import numpy as np
from sensor_msgs.msg import Image, PointCloud2


class ClassificationNode(StageNode):
    """Observe, classify, publish pixels/*."""

    def __init__(self, **kwargs):
        """Declare parameters."""
        super().__init__(CLASSIFICATION, StageConfig(), STAGES_OF[CLASSIFICATION], **kwargs)

    def configure(self):
        """Load the classifier, build the endpoints."""
        model = model_of(self)
        self.names = camera_names(self, model)
        self.classes, self.classifier = [m.name for m in model.models], model.classifier
        # The paper's forests look into all views at once, from where they were trained.
        self.trained = model.cameras if np.array_equal(
            self.classifier.get('kind'), KIND_PAPER) else ()
        if self.trained and len(self.names) != len(self.trained):
            raise HoocError(rig_trouble(self.names, self.trained))
        self.model, self.parser = model, parser_of(self, model)
        warmed(self, model, lambda views, *_: self.parser.classify(
            observe(views, self.parameters['observe'])))
        self.probabilities = self.publisher(PointCloud2, 'pixels/probabilities')
        self.labels = [self.publisher(Image, 'pixels/<camera>/labels', f'pixels/{name}/labels')
                       for name in self.names]
        self.input = ViewInput(self, self.names, 'classify', {}, self.on_views)

    def on_views(self, stamp_ns, observation, messages):
        """Classify one frame set."""
        start = time.monotonic()
        head = header(stamp_ns, self.config.target_frame)
        trouble = self.trained and rig_trouble([v.camera for v in observation.views],
                                               self.trained)
        if trouble:
            self.diagnostics.warn('model', 'other_rig', trouble)
        else:
            self.diagnostics.ok('model')
        self.parser = self.parser.changed(node_profile(self, self.model))
        probabilities = self.parser.classify(observation)
        self.probabilities.publish(
            probabilities_message(probabilities, observation, self.classes, head))
        seconds = time.monotonic() - start
        images = label_images(probabilities, observation)
        for name, publisher, image in zip(self.names, self.labels, images):
            publisher.publish(labels_message(image, header(stamp_ns, messages['frames'][name])))
        self.diagnostics.ok('classify', seconds=seconds, pixels=len(probabilities.camera))


def main(args=None):
    """Run the node; return the exit code."""
    return run_node(ClassificationNode, args)


if __name__ == '__main__':
    sys.exit(main())

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Objects that the robot hides, from the depth image to the results: flagged, not removed."""

import json

import cv2
from hooc_perception.core.geometry import posed_vertices
from hooc_perception.core.render import render_patch
from hooc_perception.nodes.warm_up import overhead_camera
import numpy as np
import pytest

pytest.importorskip('rclpy')

from geometry_msgs.msg import PoseArray  # noqa: E402
from hooc_perception.ros.messages.point_clouds import cloud_rows
from hooc_perception.ros.qos import qos
from rclpy.parameter import Parameter  # noqa: E402
from sensor_msgs.msg import PointCloud2  # noqa: E402
from std_msgs.msg import String  # noqa: E402
from visualization_msgs.msg import MarkerArray  # noqa: E402


def test_a_hidden_object_keeps_its_id_and_is_flagged(bench, make_chain, folder, tmp_path):
    # On a busy machine, minutes lie between two frame sets.
    stages, send = make_chain(parameters={
        0: {'max_frame_age_s': 0.0, 'wait_for_answer_s': 0.0},
        3: {'track_ttl_s': 3600.0, 'keep_hidden_s': 3600.0}})
    camera, truth = overhead_camera(), stages.candidates
    mask = np.zeros((camera.height, camera.width), np.uint8)
    can = folder.models[2]
    mask.ravel()[render_patch(posed_vertices(can, truth.translation[2], [0, 0, 0, 1],
                                             truth.size[2]), can.faces, camera)[0]] = 255
    cv2.imwrite(str(tmp_path / 'arm.png'), cv2.dilate(mask, np.ones((5, 5), np.uint8)))
    heard = {topic: bench.hear(kind, topic, qos('objects/poses')) for kind, topic in (
        (PointCloud2, 'objects/attributes'), (String, 'objects/labels'),
        (PoseArray, 'objects/can/poses'), (MarkerArray, 'objects/markers'),
        (PoseArray, 'objects/poses'))}

    def result(count):
        send()
        assert bench.spin(lambda: len(heard['objects/poses']) == count, 300.0)
        return cloud_rows(heard['objects/attributes'][-1])
    before = result(1)
    assert before['category'].tolist() == [1, 3] and not (before['flags'] & 8).any()
    (done,) = bench.chain[0].set_parameters([
        Parameter('mask_image.overhead', value=str(tmp_path / 'arm.png'))])
    assert done.successful
    stages.chosen = [0]             # the can is not found any more
    after = result(2)
    assert after['id'].tolist() == before['id'].tolist()
    assert after['category'].tolist() == [1, 3] and (after['flags'] & 8).tolist() == [0, 8]
    for name in ('x', 'y', 'z', 'qw', 'size_x', 'score'):
        assert after[name][1] == before[name][1]
    assert after['n_views'][1] == 0 and after['visible_ratio'][1] == 0
    assert after['age_s'][1] > after['age_s'][0]
    assert len(heard['objects/can/poses'][-1].poses) == 1
    assert str(int(before['id'][1])) in json.loads(heard['objects/labels'][-1].data)['objects']
    alpha = [m.color.a for m in heard['objects/markers'][-1].markers if m.action == m.ADD]
    assert alpha[1] < alpha[0]
    assert next(v.value for s in bench.chain[3].diagnostics.statuses()
                if s.name.endswith(': parse') for v in s.values if v.key == 'hidden') == '1'
    # The arm is gone, and so is the can.
    bench.chain[0].set_parameters([Parameter('mask_image.overhead', value='')])
    assert result(3)['id'].tolist() == [before['id'][0]]

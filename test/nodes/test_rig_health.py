# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The ingestion node reports whether its cameras agree about the surfaces that both see."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

rclpy = pytest.importorskip('rclpy')

from hooc_perception.core.geometry import pose_from_matrix  # noqa: E402
from hooc_perception.nodes.ingestion_node import IngestionNode  # noqa: E402
from hooc_perception.ros.messages import conversions as c  # noqa: E402
from rclpy.parameter import Parameter  # noqa: E402

spec = importlib.util.spec_from_file_location('raw_camera', Path(__file__).with_name(
    'raw_camera.py'))
raw_camera = importlib.util.module_from_spec(spec)
spec.loader.exec_module(raw_camera)
S = 10 ** 9


class Rig:
    """Two cameras whose stated poses may be wrong."""

    def __init__(self, bench, tabletop, period_s):
        self.bench, self.tabletop = bench, tabletop
        self.true = tabletop.camera('left', 20), tabletop.camera('right', 75)
        self.node = bench.add(IngestionNode, cameras=['left', 'right'],
                              max_frame_age_s=0.0, check_extrinsics_s=period_s)
        self.node.trigger_configure()
        self.node.trigger_activate()
        self.raw = [raw_camera.RawCamera(bench, camera.name) for camera in self.true]
        assert bench.spin(lambda: all(raw.matched() for raw in self.raw))
        self.stamp = 1000 * S
        self.views, = tabletop.scenes(self.true, self.true, [3])

    def stand(self, cameras):
        for raw, camera in zip(self.raw, cameras):
            raw.camera = camera
            raw.poses.publish(c.transform_message(
                *pose_from_matrix(camera.T_world_camera), c.header(0, 'table'),
                f'{camera.name}_optical'))
        self.bench.rest(0.2)

    def send(self):
        """Send one frame set of the true cameras."""
        self.stamp += S // 20
        for raw, view in zip(self.raw, self.views):
            raw.send(self.stamp, np.nan_to_num(1000 * view.depth).round().astype(np.uint16))

    def until(self, code):
        """Send frame sets until the pair has a reason code; return its sentence."""
        def reached():
            self.send()
            self.bench.rest(0.05)
            return self.bench.reasons(self.node).get('left + right', ' ')[0] == code
        assert self.bench.spin(reached), self.bench.reasons(self.node)
        return self.bench.reasons(self.node)['left + right'][1]

    def values(self):
        status, = (s for s in self.node.diagnostics.statuses() if s.name.endswith('left + right'))
        return {v.key: v.value for v in status.values}


def test_a_camera_that_was_knocked_is_reported_and_its_return_too(bench, tabletop):
    rig = Rig(bench, tabletop, 0.2)
    rig.stand(rig.true)
    rig.until('ok')
    assert float(rig.values()['shift_mm']) < 3 and rig.values()['place_known'] == 'True'
    knocked = tabletop.disturbed(rig.true[1], np.random.default_rng(4), 1.5, 0.02)
    rig.stand((rig.true[0], knocked))
    sentence = rig.until('poses_disagree')
    assert 'left and right' in sentence and 'hooc calibrate' in sentence
    assert float(rig.values()['shift_mm']) > 10 or float(rig.values()['turn_deg']) > 1
    rig.stand(rig.true)
    rig.until('ok')


def test_nothing_is_reported_where_it_is_switched_off(bench, tabletop):
    rig = Rig(bench, tabletop, 0.0)
    rig.stand(rig.true)
    assert bench.spin(lambda: (rig.send(), bench.rest(0.05), 'views' in bench.reasons(rig.node)
                               )[-1])
    assert 'left + right' not in bench.reasons(rig.node)
    assert rig.node.set_parameters([Parameter('check_extrinsics_s', value=0.2)])[0].successful
    rig.until('ok')

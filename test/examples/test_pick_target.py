# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The example of a planner's node, as a process of its own, against recorded answers."""

import json
import os
import subprocess
import sys
import time

from hooc_perception.core.types import Candidates, Energy, ParsedScene
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

rclpy = pytest.importorskip('rclpy')

SIZE = (0.06, 0.2, 0.1)


@pytest.fixture
def say():
    """Return (publish(stamp_ns, rows), environment of the listener) on a private domain."""
    from hooc_perception.objects.derive import derive
    from hooc_perception.ros.messages import conversions as c
    from hooc_perception.ros.messages.stages import labels_json, objects_messages
    from hooc_perception.ros.qos import qos
    from hooc_perception.supervisor.environment import claim_domain
    from sensor_msgs.msg import PointCloud2
    from std_msgs.msg import String
    import trimesh
    rng = np.random.default_rng(0)
    models = [derive(name, trimesh.creation.box(SIZE), rng, 50, 50) for name in ('box', 'drill')]
    domain, claim = claim_domain()
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=domain)
    node = rclpy.create_node('answers', namespace='/hooc', context=context)
    attributes = node.create_publisher(PointCloud2, 'objects/attributes',
                                       qos('objects/attributes'))
    labels = node.create_publisher(String, 'objects/labels', qos('objects/labels'))

    def publish(stamp_ns, *rows):
        """Publish (category, score, translation, Rotation) rows."""
        n = len(rows)
        objects = Candidates(np.array([r[0] for r in rows], np.uint16),
                             np.array([r[2] for r in rows], float),
                             np.array([r[3].as_quat() for r in rows]),
                             np.tile(np.float32(SIZE), (n, 1)),
                             np.array([r[1] for r in rows], np.float32))
        some = np.ones(n, np.float32)
        parsed = ParsedScene(objects, Energy(0, 0, 0), some, some, some, np.ones(n, np.uint8),
                             objects)
        ids = np.arange(7, 7 + n)
        attributes.publish(objects_messages(parsed, ids, 0.1, c.header(stamp_ns, 'table'))[1])
        labels.publish(String(data=labels_json(models, [[('', '')]] * 2, ids, objects)))

    yield publish, {**os.environ, 'ROS_DOMAIN_ID': str(domain),
                    'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST'}
    node.destroy_node()
    rclpy.try_shutdown(context=context)
    claim.close()


def pick(repository, environment, *words):
    """Run the example; return the process once it has ended."""
    return subprocess.run([sys.executable, str(repository / 'examples' / 'pick_target.py'),
                           *words], env=environment, capture_output=True, text=True, timeout=60)


def test_the_pose_is_above_the_surest_object_of_that_name(repository, say):
    publish, environment = say
    turned = Rotation.from_euler('z', 40, degrees=True)
    publish(time.time_ns(), (1, 0.9, (0, 0, 0.05), Rotation.identity()),
            (2, 0.6, (0.3, 0.1, 0.05), Rotation.identity()), (2, 0.8, (0.1, 0.2, 0.05), turned))
    done = pick(repository, environment, 'drill', '--clearance', '0.12')
    assert done.returncode == 0, done.stderr
    answer = json.loads(done.stdout)
    assert answer['id'] == 9 and answer['frame'] == 'table'
    assert answer['score'] == pytest.approx(0.8)
    np.testing.assert_allclose(answer['position'], (0.1, 0.2, 0.05 + 0.05 + 0.12), atol=1e-6)
    tool = Rotation.from_quat(answer['orientation_xyzw']).as_matrix()
    np.testing.assert_allclose(tool[:, 2], (0, 0, -1), atol=1e-9)
    # The jaws close along the shorter of the two lying sides: the model's x.
    assert abs(tool[:, 0] @ turned.as_matrix()[:, 0]) == pytest.approx(1, abs=1e-6)


def test_a_lying_object_is_taken_across(repository, say):
    publish, environment = say
    # On its side: the model's y, the long one, points up; x and z lie.
    publish(time.time_ns(), (1, 0.9, (0, 0, 0.1), Rotation.from_euler('x', 90, degrees=True)))
    answer = json.loads(pick(repository, environment, 'box').stdout)
    assert answer['position'][2] == pytest.approx(0.1 + 0.1 + 0.1, abs=1e-6)
    tool = Rotation.from_quat(answer['orientation_xyzw']).as_matrix()
    assert abs(tool[0, 0]) == pytest.approx(1, abs=1e-6)


def test_unsure_stale_and_absent_objects_are_not_picked(repository, say):
    publish, environment = say
    publish(time.time_ns(), (1, 0.3, (0, 0, 0.05), Rotation.identity()))
    for words in (('box',), ('drill',)):
        done = pick(repository, environment, *words, '--timeout', '2')
        assert done.returncode == 1 and f'no {words[0]}' in done.stderr and not done.stdout
    publish(time.time_ns() - 20 * 10 ** 9, (1, 0.9, (0, 0, 0.05), Rotation.identity()))
    assert pick(repository, environment, 'box', '--timeout', '2').returncode == 1
    assert pick(repository, environment, 'box', '--max-age', '60').returncode == 0

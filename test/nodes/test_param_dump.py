# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What `ros2 param dump` writes of a node is a parameter file for it."""

import pytest
import yaml

pytest.importorskip('rclpy')

from hooc_perception.nodes.ingestion_node import IngestionNode  # noqa: E402
from rclpy.lifecycle import TransitionCallbackReturn  # noqa: E402
from rclpy.parameter import parameter_value_to_python  # noqa: E402


def dumped(node):
    """Return the YAML of `ros2 param dump`, as ros2param 0.32 makes it."""
    def insert(section, key, value):
        first, _, rest = key.partition('.')
        if rest:
            insert(section.setdefault(first, {}), rest, value)
        else:
            section[key] = value

    parameters = {}
    for name in sorted(node._parameters):
        value = parameter_value_to_python(node.get_parameter(name).get_parameter_value())
        insert(parameters, name, value.tolist() if hasattr(value, 'tolist') else value)
    return yaml.dump({node.get_fully_qualified_name(): {'ros__parameters': parameters}},
                     default_flow_style=False)


def test_a_dump_can_be_loaded(bench, tmp_path):
    node = bench.add(IngestionNode, cameras=['a', 'b'], warm_up=False, max_set_spread_s=0.05,
                     camera_driver='zed', extrinsics__b=[0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0])
    assert node.trigger_configure() == TransitionCallbackReturn.SUCCESS
    text = dumped(node)
    assert 'a: []' in text      # the pose that is not set
    file = tmp_path / 'dump.yaml'
    file.write_text(text)
    again = IngestionNode(context=bench.context,
                          cli_args=['--ros-args', '--params-file', str(file)])
    bench.nodes.append(again)
    assert again.trigger_configure() == TransitionCallbackReturn.SUCCESS, bench.reasons(again)
    assert again.config == node.config and again.poses['a'] == () != again.poses['b']
    assert bench.reasons(again).get('parameters') is None


def test_a_dump_of_a_node_without_cameras_can_be_loaded(bench, tmp_path):
    text = dumped(bench.add(IngestionNode))
    assert 'cameras: []' in text
    file = tmp_path / 'dump.yaml'
    file.write_text(text)
    again = IngestionNode(context=bench.context,
                          cli_args=['--ros-args', '--params-file', str(file)])
    bench.nodes.append(again)
    assert again.config.cameras == ()

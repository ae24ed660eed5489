# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""A parameter file of the user is closed: misspelt and doubled names are errors."""

from hooc_perception.chain import CHAIN
from hooc_perception.errors import HoocError
from hooc_perception.supervisor.params_file import check_parameters
import pytest


def check(tmp_path, text):
    path = tmp_path / 'params.yaml'
    path.write_text(text)
    check_parameters(path, CHAIN, '/hooc')


def test_the_shipped_file_and_names_that_depend_on_cameras(tmp_path, repository):
    check_parameters(repository / 'config' / 'perception.yaml', CHAIN, '/hooc')
    check(tmp_path, """
/**:
  ros__parameters:
    use_sim_time: true
    observe: {max_depth_m: 3.0}
    extrinsics.left: []
    image_topic.left: /left/depth
    qos_overrides./hooc/views/points.publisher.depth: 5
/other_robot/driver:
  ros__parameters: {speed: 3}
""")


@pytest.mark.parametrize('text, words', [
    ('/**:\n  ros__parameters: {observe: {max_dept_m: 3.0}}', 'observe.max_depth_m meant'),
    ('/**:\n  ros__parameters: {observe.max_dept_m: 3.0}', 'observe.max_depth_m meant'),
    ('/hooc/parsing_node:\n  ros__parameters: {sede: 3}', 'parsing_node.*sede.*seed meant'),
    ('/hooc:\n  ingestion_node:\n    ros__parameters: {target_frames: map}', 'target_frame meant'),
    ('/**:\n  ros__parameters: {colour: red}', 'colour is unknown'),
    ('/**:\n  ros__parameters: {seed: 1, seed: 2}', "'seed' stands twice")])
def test_what_no_node_has_is_refused(tmp_path, text, words):
    with pytest.raises(HoocError, match=words) as caught:
        check(tmp_path, text)
    assert 'params.yaml' in str(caught.value) and ';' in str(caught.value)

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The RViz config and the Foxglove layout show topics that there are, as they are offered."""

import json
import re

import pytest
import yaml

pytest.importorskip('rclpy')

from hooc_perception.chain import TOPICS

DISPLAYS = {'MarkerArray': {'objects/markers'}, 'PoseArray': {'objects/poses'},
            'PointCloud2': {'views/points', 'scene/unexplained'},
            'Image': {'views/<camera>/depth_rect'}}


def row_of(topic):
    """Return the row of TOPICS that a real topic is of."""
    name = topic.removeprefix('/hooc/')
    return next(row for row in TOPICS
                if re.fullmatch(re.sub(r'<\w+>', r'\\w+', row), name) and '<category>' not in row)


def test_rviz_shows_our_topics_with_our_qos(repository):
    content = yaml.safe_load((repository / 'config' / 'hooc.rviz').read_text())
    manager = content['Visualization Manager']
    assert manager['Global Options']['Fixed Frame'] == 'table'
    shown = set()
    for display in manager['Displays']:
        kind = display['Class'].partition('/')[2]
        if 'Topic' not in display:
            assert kind in ('Grid', 'TF')
            continue
        row = row_of(display['Topic']['Value'])
        assert row in DISPLAYS[kind]
        shown.add(row)
        depth, latched = TOPICS[row].depth, TOPICS[row].latched
        # A volatile reader of a latched topic would wait for the next answer.
        assert display['Topic']['Durability Policy'] == ('Transient Local' if latched
                                                         else 'Volatile')
        assert display['Topic']['Depth'] == depth
    assert shown == set().union(*DISPLAYS.values())


def test_foxglove_shows_our_topics(repository):
    layout = json.loads((repository / 'config' / 'foxglove_layout.json').read_text())
    panels, topics = layout['configById'], set()
    for name, panel in panels.items():
        topics |= set(panel.get('topics', {}))
        topics |= {panel[key] for key in ('topicPath',) if key in panel}
        topics |= {panel['imageMode']['imageTopic']} if panel.get('imageMode') else set()

    def leaves(node):
        if isinstance(node, str):
            return {node}
        assert 0 < node['splitPercentage'] < 100
        return leaves(node['first']) | leaves(node['second'])

    assert leaves(layout['layout']) == set(panels)
    assert {row_of(topic) for topic in topics} >= {
        'objects/markers', 'objects/poses', 'scene/unexplained', 'views/points',
        '<camera>/depth/image_raw', 'scene/summary', 'objects/labels'}

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
The chain, declared once: its nodes, their topics, the profiles, and names as parts of topics.

Imports nothing but the standard library, so that launch files and the command line may read it.
"""

from collections.abc import Iterable
from dataclasses import dataclass
import re

from hooc_perception.errors import HoocError

INGESTION, CLASSIFICATION = 'ingestion_node', 'classification_node'
CANDIDATES, PARSING = 'candidate_node', 'parsing_node'
# The nodes in the order in which a frame set passes through them.
CHAIN = (INGESTION, CLASSIFICATION, CANDIDATES, PARSING)
REPLAY = 'replay_node'
NODES = (*CHAIN, REPLAY)

PROFILES = ('paper', 'best', 'fast')
STAGES = ('observe', 'classify', 'propose', 'parse')
# The stages whose parameters a node declares. Candidates are ranked by the pixel costs of `parse`,
# and parsing proposes again: both nodes declare both.
STAGES_OF = {INGESTION: ('observe',), CLASSIFICATION: ('classify',),
             CANDIDATES: ('propose', 'parse'), PARSING: ('propose', 'parse'), REPLAY: ()}


@dataclass(frozen=True)
class Topic:
    """
    One row of the table of topics.

    :ivar depth: how many messages the publisher and each subscription keep.
    :ivar latched: whether a late subscriber gets the last messages (transient local).
    :ivar publisher: the node that publishes it; empty where several nodes or others do.
    :ivar needed_by: nodes that cannot work on a frame set without it.
    """

    depth: int
    latched: bool = False
    publisher: str = ''
    needed_by: tuple[str, ...] = ()


_LATER = CHAIN[1:]
# Name without the namespace -> Topic. `<camera>` and `<category>` stand for any name. Four
# messages deep: a node that is busy while the next frame set arrives still finds whole sets.
TOPICS = {
    '<camera>/depth/image_raw': Topic(4, needed_by=(INGESTION,)),
    '<camera>/depth/camera_info': Topic(4, needed_by=(INGESTION,)),
    '<camera>/extrinsics': Topic(1, latched=True, needed_by=(INGESTION,)),
    'views/<camera>/depth_rect': Topic(4, False, INGESTION, _LATER),
    'views/<camera>/camera_info': Topic(4, True, INGESTION, _LATER),
    'views/<camera>/segments': Topic(4, False, INGESTION, _LATER),
    'views/poses': Topic(4, False, INGESTION, _LATER),
    'views/<camera>/extrinsics': Topic(4, True, INGESTION),
    'views/<camera>/count': Topic(1, False, INGESTION),
    'views/points': Topic(1, False, INGESTION),
    'views/refused': Topic(4, needed_by=(INGESTION,)),
    'pixels/probabilities': Topic(4, False, CLASSIFICATION, (CANDIDATES, PARSING)),
    'pixels/<camera>/labels': Topic(1, False, CLASSIFICATION),
    'candidates/poses': Topic(4, False, CANDIDATES, (PARSING,)),
    'candidates/attributes': Topic(4, False, CANDIDATES, (PARSING,)),
    'objects/poses': Topic(1, True, PARSING),
    'objects/attributes': Topic(1, True, PARSING),
    'objects/labels': Topic(1, True, PARSING),
    'objects/<category>/poses': Topic(1, True, PARSING),
    'objects/markers': Topic(1, True, PARSING),
    'objects/unknown': Topic(1, True, PARSING),
    'objects/unknown_attributes': Topic(1, True, PARSING),
    'objects/detections': Topic(1, True, PARSING),
    'objects/events': Topic(10, True, PARSING),
    'scene/table': Topic(1, True, INGESTION),
    'scene/unexplained': Topic(1, True, PARSING),
    'scene/summary': Topic(1, True, PARSING),
    '/robot_description': Topic(1, latched=True),
    '/joint_states': Topic(100),
    '/tf': Topic(100),
    '/planning_scene': Topic(10),
    'replay/status': Topic(1, True, REPLAY),
}


def node_class(node: str) -> str:
    """Return the name of the class in a node's module: ParsingNode for parsing_node."""
    return ''.join(word.capitalize() for word in node.split('_'))


def topic_token(name: str) -> str:
    """Return a name as a token that a topic or frame may hold: letters, digits, underscores."""
    token = re.sub(r'[^A-Za-z0-9_]', '_', name)
    return f'_{token}' if token[:1].isdigit() else token


def check_categories(names: Iterable[str], where: str) -> None:
    """
    Reject category names of which two become the same token.

    Their results would be latched on one topic, where each hides the other.

    :param where: begins the sentence.
    :raises HoocError: with both names.
    """
    tokens: dict[str, str] = {}
    for name in names:
        token = topic_token(name)
        if token in tokens:
            raise HoocError(f'{where}: the categories {tokens[token]!r} and {name!r} would share '
                            f'the topic objects/{token}/poses; rename one of them')
        tokens[token] = name

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Joint positions at the stamp of an image."""

import pytest

pytest.importorskip('rclpy')

from hooc_perception.ros.inputs.joint_states import (  # noqa: E402
    JointStates,
    StateNotYet,
    StateUnknown,
)
from hooc_perception.ros.messages.conversions import header  # noqa: E402
from sensor_msgs.msg import JointState  # noqa: E402

MS = 10**6


def state(ms, **positions):
    return JointState(header=header(ms * MS, ''), name=list(positions),
                      position=list(map(float, positions.values())))


def states(*messages):
    made = JointStates()
    for message in messages:
        made.add(message, 0)
    return made


def test_positions_are_interpolated():
    known = states(state(1000, a=0, b=5), state(1100, a=1), state(1100, b=7))
    assert known.names == {'a', 'b'}
    assert known.at(1025 * MS, ['a', 'b'], 100 * MS) == pytest.approx({'a': 0.25, 'b': 5.5})
    assert known.at(1100 * MS, ['a'], 0) == {'a': 1.0}


def test_a_state_that_is_still_to_come():
    known = states(state(1000, a=0), state(1100, a=1))
    with pytest.raises(StateNotYet):
        known.at(1150 * MS, ['a'], 100 * MS)
    assert known.at(1150 * MS, ['a'], 100 * MS, final=True) == {'a': 1.0}


@pytest.mark.parametrize('ms, joints, code, word', [
    (1000, ['a', 'c'], 'no_joint_state', 'position of c'),
    (1201, ['a'], 'old_joint_state', '0.101 s away'),
    (800, ['a'], 'old_joint_state', 'robot_state_age_s'),
    (1050, ['a'], 'old_joint_state', '0.05 s away')])
def test_unknown_states_have_a_reason(ms, joints, code, word):
    known = states(state(1000, a=0), state(1100, a=1))
    within = 49 if ms == 1050 else 100
    with pytest.raises(StateUnknown, match=word) as caught:
        known.at(ms * MS, joints, within * MS, final=True)
    assert caught.value.code == code


def test_time_that_is_set_back_forgets_and_late_messages_do_not():
    known = states(state(5000, a=1), state(4990, a=9))
    assert known.at(5000 * MS, ['a'], 0) == {'a': 1.0}
    known.add(state(1000, a=2), 0)
    assert known.at(1000 * MS, ['a'], 0) == {'a': 2.0}


def test_messages_without_stamps_or_numbers():
    known = JointStates()
    known.add(state(0, a=3), 700 * MS)
    known.add(JointState(name=['b', 'c'], position=[float('nan')]), 700 * MS)
    assert known.at(700 * MS, ['a'], 0) == {'a': 3.0} and known.names == {'a'}

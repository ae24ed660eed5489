# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Bags that are looped with their own stamps, however short; strays stay strays."""

from hooc_perception.io.frame_sets import FrameSetConfig, FrameSets
import pytest

MS = 1_000_000
T0 = 10 ** 9 * 1000


def looped(cameras, sets, period_ms, loops=5, simulated=False, **changes):
    """Return the numbers of sets that came out in each pass of a bag, and the FrameSets."""
    assembly = FrameSets(cameras, FrameSetConfig(max_frame_age_s=0.0, **changes))
    out, now = [], 50 * T0
    for _ in range(loops):
        out.append(0)
        for i in range(sets):
            now += period_ms * MS
            for camera in cameras:
                stamp = T0 + i * period_ms * MS
                clock = stamp + MS if simulated else now
                assembly.add(camera, stamp, (camera, i), clock)
                frame_set = assembly.take(clock)
                if frame_set:
                    out[-1] += 1
                    assert frame_set.frames == tuple((c, i) for c in cameras)
    return out, assembly


@pytest.mark.parametrize('sets, period_ms', [(1, 100), (2, 33), (10, 100), (30, 33), (60, 33)])
@pytest.mark.parametrize('cameras', ['ab', 'abc'])
def test_no_set_of_a_looped_bag_is_lost(cameras, sets, period_ms):
    out, assembly = looped(cameras, sets, period_ms)
    assert out == [sets] * 5
    # Once a loop; the frames that had seemed old were used after all, and are not counted.
    jumps = assembly.drops.total()
    assert jumps == sum(assembly.drops[c, 'time_jump'] for c in cameras)
    assert sum((assembly.new_drops()).values()) == jumps


@pytest.mark.parametrize('sets, period_ms', [(1, 100), (2, 33), (10, 100), (30, 33)])
def test_one_camera_alone_goes_on_after_a_few_frames(sets, period_ms):
    out, assembly = looped('a', sets, period_ms, loops=9)
    assert sum(out) >= 9 * sets - 2 * 8 * min(sets, 1) - 2 and sum(out[3:]) > 0
    assert max(n for n in out[1:]) >= sets - 2


@pytest.mark.parametrize('sets', [2, 10])
def test_a_simulated_clock_that_goes_back_tells_at_once(sets):
    out, assembly = looped('a', sets, 33, simulated=True)
    assert out == [sets] * 5


def test_a_lost_camera_is_not_waited_for():
    assembly = FrameSets('abc', FrameSetConfig(max_frame_age_s=0.0, camera_timeout_s=0.5))
    out = []
    for now in range(0, 6000, 100):
        for camera in 'ab':
            assembly.add(camera, T0 + now % 300 * MS, camera, T0 + now * MS)
            out.append((now, assembly.take(T0 + now * MS)))
    assert assembly.lost == {'c': 'silent'}
    assert sum(s is not None for now, s in out if now >= 3000) == 30


def test_strays_between_newer_frames_stay_strays():
    assembly = FrameSets('ab', FrameSetConfig(max_frame_age_s=0.0))
    number = 0
    for i in range(1, 30):
        for camera in 'ab':
            assembly.add(camera, T0 + 33 * i * MS, camera, T0 + 33 * i * MS)
            number += assembly.take(T0 + 33 * i * MS) is not None
            assert assembly.add(camera, T0 + (33 * i - 20) * MS, 'old', T0 + 33 * i * MS) == (
                'out_of_order')
    assert number == 29 and not assembly.drops['a', 'time_jump']


@pytest.mark.parametrize('order', [
    'a0 b0 a0 b0 a33 b33 a33 b33', 'a0 a0 b0 b0 a33 a33 b33 b33', 'a0 b0 b0 a0 b33 a33 b33 a33'])
def test_a_stream_that_comes_twice_gives_each_set_once(order):
    assembly, stamps = FrameSets('ab', FrameSetConfig(max_frame_age_s=0.0)), []
    for text in order.split():
        stamp = T0 + int(text[1:]) * MS
        assembly.add(text[0], stamp, text, stamp)
        frame_set = assembly.take(stamp)
        stamps += [frame_set.stamp_ns] if frame_set else []
    assert stamps == [T0, T0 + 33 * MS]


def test_a_driver_that_hangs_is_no_loop():
    assembly = FrameSets('ab', FrameSetConfig(max_frame_age_s=0.0))
    for i in range(20):
        for camera, stamp in (('a', 0), ('b', 33 * i)):
            reason = assembly.add(camera, T0 + stamp * MS, camera, T0 + 33 * i * MS)
            assert reason in ((None, 'superseded') if camera == 'b' or not i else ('duplicate',))


def test_old_frames_by_the_clock_are_no_loop():
    assembly = FrameSets('ab', FrameSetConfig(max_frame_age_s=0.5))
    reasons = [assembly.add(camera, T0, camera, T0 + 600 * i * MS)
               for i in range(5) for camera in 'ab']
    assert reasons == [None, None] + ['duplicate'] * 8

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Frame sets from free-running cameras in every order of arrival."""

from dataclasses import replace
import itertools

from hooc_perception.errors import HoocError
from hooc_perception.io.frame_sets import EXPLAINED, FrameSetConfig, FrameSets
from hooc_perception.ros.inputs.stamp_join import StampJoin
import numpy as np
import pytest

MS = 1_000_000
T0 = 1_000_000 * MS


def sets(*cameras, **changes):
    return FrameSets(cameras or 'abc', FrameSetConfig(**changes))


def feed(assembly, *frames, lag_ms=1):
    """Add frames given as 'camera milliseconds'; return all sets that come out."""
    out = []
    for text in frames:
        camera, at = text.split()
        stamp = T0 + round(float(at) * MS)
        now = stamp + lag_ms * MS
        assembly.add(camera, stamp, text, now)
        frame_set = assembly.take(now)
        if frame_set:
            out.append(frame_set)
    return out


@pytest.mark.parametrize('order', itertools.permutations(['a 0', 'b 5', 'c 9']))
def test_any_order_gives_one_set_in_camera_order(order):
    (only,) = feed(sets(), *order)
    assert only.frames == ('a 0', 'b 5', 'c 9')
    assert only.stamp_ns == T0


def test_stamp_is_the_oldest():
    (only,) = feed(sets(), 'a 30', 'b 20', 'c 25')
    assert only.stamp_ns == T0 + 20 * MS


def test_one_camera_is_a_rig():
    assert [s.stamp_ns for s in feed(sets('a'), 'a 0', 'a 33', 'a 66')] == [
        T0, T0 + 33 * MS, T0 + 66 * MS]


def test_every_frame_is_used_once():
    out = feed(sets(), 'a 0', 'b 0', 'c 0', 'a 33', 'b 33', 'a 66', 'c 66')
    assert [s.frames for s in out] == [('a 0', 'b 0', 'c 0'), ('a 66', 'b 33', 'c 66')]


def test_stamps_of_sets_increase():
    rng = np.random.default_rng(0)
    at = {camera: rng.uniform(0, 33) for camera in 'abc'}
    frames = []
    for _ in range(200):
        camera = min(at, key=at.get)
        frames.append(f'{camera} {at[camera]:.3f}')
        at[camera] += rng.uniform(25, 45)
    out = [s.stamp_ns for s in feed(sets(), *frames)]
    assert len(out) > 40 and all(a < b for a, b in zip(out, out[1:]))


def test_latest_frame_wins():
    assembly = sets()
    out = feed(assembly, 'a 0', 'a 33', 'b 40', 'c 41')
    assert out[0].frames == ('a 33', 'b 40', 'c 41')
    assert assembly.drops == {('a', 'superseded'): 1}


def test_duplicates_and_late_frames_are_dropped_with_a_reason():
    assembly = sets()
    feed(assembly, 'a 50', 'a 50')
    assembly.add('a', T0 + 20 * MS, 'a 20', T0 + 51 * MS)
    assert assembly.drops == {('a', 'duplicate'): 1, ('a', 'out_of_order'): 1}
    (only,) = feed(assembly, 'b 51', 'c 52')
    assert only.frames[0] == 'a 50'


def test_a_frame_that_comes_again_after_its_use_is_a_duplicate():
    assembly = sets()
    assert len(feed(assembly, 'a 0', 'b 0', 'c 0', *['a 0', 'b 0'] * 9)) == 1
    assert assembly.drops == {(camera, 'duplicate'): 9 for camera in 'ab'}


def test_old_frames_are_stale_at_once():
    assembly = sets(max_frame_age_s=0.5)
    assert feed(assembly, 'a 0', 'b 0', 'c 0', lag_ms=600) == []
    assert assembly.drops == {(camera, 'stale'): 1 for camera in 'abc'}


def test_frames_expire_while_they_wait():
    assembly = sets(max_frame_age_s=0.5, max_set_spread_s=10.0)
    assert feed(assembly, 'a 0', 'b 0', 'c 700') == []
    assert assembly.drops == {('a', 'expired'): 1, ('b', 'expired'): 1}


def test_age_zero_accepts_any_age():
    assert len(feed(sets(max_frame_age_s=0.0), 'a 0', 'b 0', 'c 0', lag_ms=10**9)) == 1


def test_spread_drops_those_who_lag():
    assembly = sets(max_set_spread_s=0.1)
    assert feed(assembly, 'a 0', 'b 90', 'c 110') == []
    assert assembly.drops == {('a', 'spread'): 1}
    (only,) = feed(assembly, 'a 120')
    assert only.frames == ('a 120', 'b 90', 'c 110')


def test_spread_at_its_limit_is_allowed():
    assert len(feed(sets(max_set_spread_s=0.1), 'a 0', 'b 100', 'c 50')) == 1
    assert len(feed(sets(max_set_spread_s=0.1), 'a 0', 'b 100.001', 'c 50')) == 0


def test_dead_camera_gives_no_sets_and_says_who_is_missing():
    assembly = sets()
    assert feed(assembly, *(f'{camera} {33 * i}' for i in range(50) for camera in 'ab')) == []
    assert assembly.missing() == ['c']


def test_unknown_camera():
    assembly = sets()
    assert assembly.add('d', T0, 'd', T0) == 'unknown_camera'
    assert len(feed(assembly, 'a 0', 'b 0', 'c 0')) == 1


def test_looped_bag_starts_over():
    assembly = sets(max_frame_age_s=0.0, time_jump_s=1.0)
    first = [f'{camera} {5000 + 33 * i}' for i in range(3) for camera in 'abc']
    again = [f'{camera} {33 * i}' for i in range(3) for camera in 'abc']
    out = feed(assembly, *first, 'a 5100', *again)
    assert len(out) == 6
    assert assembly.drops[('a', 'time_jump')] == 1
    # What waited from before the jump is not mixed with what came after.
    assert all('5100' not in frame for s in out[3:] for frame in s.frames)


def test_every_reason_that_loses_a_wanted_frame_is_explained():
    assert {'stale', 'out_of_order', 'duplicate', 'time_jump', 'spread'} <= EXPLAINED.keys()


def test_new_drops_are_told_once():
    assembly = sets()
    feed(assembly, 'a 50', 'a 50')
    assert assembly.new_drops() == {('a', 'duplicate'): 1}
    assert assembly.new_drops() == {}
    feed(assembly, 'a 50')
    assert assembly.new_drops() == {('a', 'duplicate'): 1}


def test_config_names_the_parameter():
    with pytest.raises(HoocError, match='max_set_spread_s'):
        replace(FrameSetConfig(), max_set_spread_s=-1.0)


def join(*parts, **kwargs):
    return StampJoin(parts or ('views', 'pixels'), **kwargs)


@pytest.mark.parametrize('order', itertools.permutations('xyz'))
def test_join_in_any_order(order):
    j = join(*'xyz')
    results = [j.add(part, 5, part.upper()) for part in order]
    assert results == [None, None, {'x': 'X', 'y': 'Y', 'z': 'Z'}]


def test_join_keeps_stamps_apart():
    j = join()
    assert j.add('views', 1, 'v1') is None
    assert j.add('pixels', 2, 'p2') is None
    assert j.add('pixels', 1, 'p1') == {'views': 'v1', 'pixels': 'p1'}
    assert j.add('views', 2, 'v2') == {'views': 'v2', 'pixels': 'p2'}
    assert not j.drops


def test_join_drops_what_is_overtaken():
    j = join()
    j.add('views', 1, 'v1')
    j.add('views', 2, 'v2')
    assert j.add('pixels', 2, 'p2')
    assert j.drops == {('pixels', 'incomplete'): 1}
    assert j.add('pixels', 1, 'p1') is None


def test_join_is_bounded():
    j = join(capacity=3)
    for stamp in range(10):
        j.add('views', stamp, stamp)
    assert j.drops == {('pixels', 'incomplete'): 7}
    assert j.add('pixels', 6, 'late') is None
    assert j.add('pixels', 9, 'p')


def test_join_survives_a_time_jump():
    j = join()
    j.add('views', 100, 'v')
    assert j.add('pixels', 100, 'p')
    j.add('views', 3, 'v')
    assert j.add('pixels', 3, 'p')


def test_repeated_part_replaces():
    j = join()
    j.add('views', 1, 'old')
    j.add('views', 1, 'new')
    assert j.add('pixels', 1, 'p')['views'] == 'new'


# Cameras that drop out. Frames every 33 ms; `feed` takes with each of them.

def stream(cameras, start_ms, stop_ms, period_ms=33, shift=()):
    """Return frames of free-running cameras as `feed` wants them, in the order of time."""
    shift = dict(shift)
    frames = [(t + i, f'{camera} {t + i + shift.get(camera, 0)}')
              for t in range(start_ms, stop_ms, period_ms) for i, camera in enumerate(cameras)]
    return [text for _, text in sorted(frames)]


def test_a_camera_that_vanishes_is_left_out_and_comes_back():
    assembly = sets(camera_timeout_s=0.5)
    assert all(None not in s.frames for s in feed(assembly, *stream('abc', 0, 1000)))
    alone = feed(assembly, *stream('ab', 1000, 3000))
    assert assembly.lost == {'c': 'silent'}
    # Half a second of waiting, then every set.
    assert {s.frames.index(None) for s in alone} == {2}
    assert 40 < len(alone) < 50
    assert assembly.drops['c', 'spread'] == 0
    again = feed(assembly, *stream('abc', 3000, 4000))
    assert assembly.lost == {} and all(None not in s.frames for s in again[1:])


@pytest.mark.parametrize('period', [33, 500, 1000])
def test_it_comes_back_at_any_rate(period):
    assembly = sets(camera_timeout_s=2.0)
    feed(assembly, *stream('ab', 0, 10000, period))
    assert assembly.lost == {'c': 'silent'}
    again = feed(assembly, *stream('abc', 10000, 20000, period))
    assert assembly.lost == {} and None not in again[-1].frames


def test_a_camera_that_never_came_is_not_waited_for_forever():
    out = feed(sets(camera_timeout_s=0.5), *stream('bc', 0, 2000))
    assert len(out) > 40 and all(s.frames[0] is None for s in out)


def test_two_of_three_may_vanish():
    assembly = sets(camera_timeout_s=0.5)
    feed(assembly, *stream('abc', 0, 500), *stream('ab', 500, 2000))
    out = feed(assembly, *stream('b', 2000, 4000))
    assert assembly.lost == {'a': 'silent', 'c': 'silent'}
    assert out[-1].frames == (None, out[-1].frames[1], None)


def test_fewer_than_asked_for_are_no_set():
    assembly = sets(camera_timeout_s=0.5, min_cameras=2)
    assert feed(assembly, *stream('b', 0, 3000)) == []
    assert feed(assembly, *stream('ab', 3000, 6000))


def test_timeout_zero_always_waits():
    assembly = sets(camera_timeout_s=0.0)
    assert feed(assembly, *stream('ab', 0, 20000)) == [] and assembly.lost == {}


def test_after_a_pause_of_all_nobody_is_missed():
    assembly = sets(camera_timeout_s=0.5)
    feed(assembly, *stream('abc', 0, 500))
    out = feed(assembly, 'a 20000', 'b 20001', 'c 20002')
    assert [None in s.frames for s in out] == [False]


@pytest.mark.parametrize('offset', [-500, 500])
def test_a_clock_that_is_off_loses_its_camera_not_the_others(offset):
    assembly = sets(camera_timeout_s=0.5)
    frames = [(t + i, camera, t + i + (offset if camera == 'b' else 0))
              for t in range(0, 4000, 33) for i, camera in enumerate('abc')]
    out = []
    for now, camera, stamp in frames:
        assembly.add(camera, T0 + stamp * MS, camera, T0 + now * MS)
        out.append(assembly.take(T0 + now * MS))
    assert assembly.lost == {'b': 'apart'}
    done = [s.frames for s in out if s]
    assert len(done) > 80 and set(done) == {('a', None, 'c')}
    assert assembly.drops['b', 'spread'] > 0
    # Its clock is set right: it is one of them again.
    (last,) = feed(assembly, 'a 5100', 'b 5101', 'c 5102')
    assert None not in last.frames and assembly.lost == {}


def test_stamps_of_zero_and_from_the_future():
    assembly = sets('a', max_frame_age_s=1.0)
    assert assembly.add('a', 0, 'x', T0) == 'no_stamp'
    assert assembly.add('a', T0 + 1100 * MS, 'x', T0) == 'future'
    # It has not spoilt what comes after it.
    assert assembly.add('a', T0, 'x', T0) is None
    assert assembly.take(T0).frames == ('x',)
    assert sets('a', max_frame_age_s=0.0).add('a', 2 * T0, 'x', T0) is None


def test_a_clock_that_is_set_back_does_not_stop_the_sets():
    assembly = sets(max_frame_age_s=1.0, camera_timeout_s=0.5)
    feed(assembly, *stream('abc', 50000, 52000))
    assert len(feed(assembly, *stream('abc', 0, 1000))) > 25
    assert len(feed(assembly, *stream('ab', 1000, 3000))) > 25
    assert assembly.lost == {'c': 'silent'}


@pytest.mark.parametrize('n', range(1, 9))
def test_one_to_eight_cameras_in_any_mood(n):
    """Nothing that cameras do stops the rest, and every frame is used or counted."""
    rng = np.random.default_rng(n)
    cameras = 'abcdefgh'[:n]
    assembly = sets(*cameras, camera_timeout_s=0.3)
    at, given, used, last, longest = T0, 0, 0, T0, 0
    down = dict.fromkeys(cameras, 0)
    for i in range(3000):
        at += int(rng.integers(10, 50)) * MS // n
        camera = cameras[i % n]
        if rng.random() < 0.002:
            down[camera] = at + int(rng.integers(100, 3000)) * MS
        if at < down[camera]:
            continue
        odd = rng.random() < 0.01
        stamp = at - int(rng.choice([400, 2000, 5000, -2000] if odd else [0, 0, 5, 10])) * MS
        given += 1
        lost = assembly.add(camera, stamp if rng.random() > 0.01 else 0, camera, at)
        frame_set = assembly.take(at)
        if frame_set:
            used += sum(frame is not None for frame in frame_set.frames)
            longest, last = max(longest, at - last), at
    waiting = n - len(assembly.missing())
    superseded = assembly.drops.total()
    assert lost is None or isinstance(lost, str)
    jumps = sum(number for (_, reason), number in assembly.drops.items() if reason == 'time_jump')
    # A jump counts even if its camera had nothing that waited.
    assert given <= used + superseded + waiting <= given + jumps
    assert used > 0.7 * given and (n == 1 or longest < 2500 * MS)

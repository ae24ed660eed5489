# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Recorded images are paced like live ones."""

from hooc_perception.ros.outputs.player import Player, PlayerConfig
import pytest

MS = 1_000_000
RECORDED = [(camera, 5_000 * MS + i * 100 * MS, f'{camera}{i}')
            for i in range(3) for camera in 'ab']


def play(player, until_ms=1000, step_ms=1, start_ms=77_000, answer_after_ms=None):
    """Poll a player like a timer does; return [(milliseconds, Due)]."""
    out, held_since = [], None
    for t in range(start_ms, start_ms + until_ms, step_ms):
        if player.waits_for_release and answer_after_ms is not None:
            held_since = held_since or t
            if t - held_since >= answer_after_ms:
                player.released()
                held_since = None
        due = player.due(t * MS)
        if due:
            out.append((t - start_ms, due))
        if player.finished:
            break
    return out


def test_recorded_distances_and_a_gap():
    out = play(Player(lambda: iter(RECORDED)))
    assert [d.message for _, d in out] == ['a0', 'b0', 'a1', 'b1', 'a2', 'b2']
    assert [t for t, _ in out] == [0, 5, 100, 105, 200, 205]
    # Stamps keep the recorded distances: both images of a set have the same one.
    assert [d.stamp_ns // MS - 77_000 for _, d in out] == [0, 0, 100, 100, 200, 200]


def test_rate():
    out = play(Player(lambda: iter(RECORDED), PlayerConfig(rate=2.0)))
    assert [t for t, _ in out] == [0, 5, 50, 55, 100, 105]
    assert [d.stamp_ns // MS - 77_000 for _, d in out] == [0, 0, 50, 50, 100, 100]


def test_recorded_stamps_on_request():
    out = play(Player(lambda: iter(RECORDED), PlayerConfig(restamp=False)))
    assert [d.stamp_ns for _, d in out] == [stamp for _, stamp, _ in RECORDED]


def test_loop_starts_again_with_later_stamps():
    out = play(Player(lambda: iter(RECORDED), PlayerConfig(loop=True)), until_ms=700)
    assert len(out) > 12
    stamps = [d.stamp_ns for _, d in out if d.camera == 'a']
    assert all(x < y for x, y in zip(stamps, stamps[1:]))


@pytest.mark.parametrize('rate', [0.1, 1.0, 2.0])
def test_one_set_is_looped_once_a_second(rate):
    out = play(Player(lambda: iter(RECORDED[:2]), PlayerConfig(loop=True, rate=rate)),
               until_ms=round(3500 / rate))
    assert [t for t, d in out if d.camera == 'a'] == [round(i * 1000 / rate) for i in range(4)]
    assert len(out) == 8


def test_there_is_one_period_between_two_passes():
    out = play(Player(lambda: iter(RECORDED), PlayerConfig(loop=True)), until_ms=900)
    assert [t for t, d in out if d.camera == 'a'] == [i * 100 for i in range(9)]


def test_rate_zero_waits_for_no_seam():
    out = play(Player(lambda: iter(RECORDED), PlayerConfig(rate=0.0, loop=True)),
               answer_after_ms=10, until_ms=200)
    assert len(out) > 18


def test_rate_zero_waits_for_answers():
    player = Player(lambda: iter(RECORDED), PlayerConfig(rate=0.0))
    assert [d.message for _, d in play(player)] == ['a0', 'b0']
    assert player.waits_for_release and player.set_stamp_ns == 77_000 * MS


def test_rate_zero_goes_as_fast_as_answers_come():
    out = play(Player(lambda: iter(RECORDED), PlayerConfig(rate=0.0)), answer_after_ms=10)
    assert [d.message for _, d in out] == ['a0', 'b0', 'a1', 'b1', 'a2', 'b2']
    assert out[-1][0] < 60


def test_late_timer_catches_up():
    out = play(Player(lambda: iter(RECORDED)), step_ms=150, until_ms=2000)
    assert len(out) == 6
    assert [d.stamp_ns // MS - 77_000 for _, d in out] == [0, 0, 100, 100, 200, 200]


def test_empty_recording():
    player = Player(lambda: iter([]), PlayerConfig(loop=True))
    assert player.finished and player.due(0) is None

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Days beside a robot, in short: nothing grows, and every frame is used or counted."""

from collections import Counter, deque
import ctypes
import gc
import importlib.util
from pathlib import Path
import sys

from hooc_perception.errors import HoocError
import numpy as np
import pytest

pytest.importorskip('rclpy')

from geometry_msgs.msg import PoseArray  # noqa: E402
from hooc_perception.nodes.ingestion_node import IngestionNode
from hooc_perception.ros.messages import conversions as c
from hooc_perception.ros.qos import qos
from hooc_perception.supervisor import environment
from rclpy.lifecycle import TransitionCallbackReturn  # noqa: E402

spec = importlib.util.spec_from_file_location('raw_camera', Path(__file__).with_name(
    'raw_camera.py'))
raw_camera = importlib.util.module_from_spec(spec)
spec.loader.exec_module(raw_camera)

SETS, LOOP, STEPS, MS = 1000, 250, 300, 10 ** 6


class MallInfo(ctypes.Structure):
    """What mallinfo2(3) of the C library returns."""

    _fields_ = [(name, ctypes.c_size_t) for name in (
        'arena', 'ordblks', 'smblks', 'hblks', 'hblkhd', 'usmblks', 'fsmblks', 'uordblks',
        'fordblks', 'keepcost')]


def allocated():
    """
    Return (bytes that malloc has handed out, number of small objects of Python).

    The resident memory of a process that has run a thousand tests moves by megabytes when the
    allocator takes or returns pages, and stays where a leak fits into what is free. This does not:
    arrays and what C++ makes are in the first number, Python's own objects in the second.
    """
    gc.collect()
    measure = getattr(ctypes.CDLL(None), 'mallinfo2', None)
    if measure is None:      # another C library
        return 0, sys.getallocatedblocks()
    measure.restype = MallInfo
    info = measure()
    return info.uordblks + info.hblkhd, sys.getallocatedblocks()


def test_a_thousand_sets_in_a_loop_with_drop_outs(bench):
    """Through the node itself, on a clock of our own: half an hour at 0.5 Hz in seconds."""
    rng, names = np.random.default_rng(0), ('a', 'b', 'c')
    node = bench.add(IngestionNode, cameras=list(names), warm_up=False, wait_for_answer_s=0.0,
                     camera_timeout_s=0.3, explain_after_s=0.0, fuse_frames=3,
                     max_frame_age_s=0.0)
    assert node.trigger_configure() == TransitionCallbackReturn.SUCCESS
    assert node.trigger_activate() == TransitionCallbackReturn.SUCCESS
    clock, sent, used = [10 ** 18], [], []
    node.now_ns = lambda: clock[0]
    publish = node.work.output.publish
    node.work.output.publish = lambda head, *rest: (
        sent.append(c.nanoseconds(head.stamp)), publish(head, *rest))
    inputs = {camera.name: camera for camera in node.work.inputs}
    images = [raw_camera.a_depth(i) for i in range(4)]
    pose = c.transform_message([0.1, 0.2, 1.0], raw_camera.ROTATION, c.header(0, 'table'), 'x')
    infos = {name: raw_camera.a_camera(name) for name in names}
    away, given, looped = dict.fromkeys(names, 0), 0, 0
    for camera in inputs.values():
        camera._on_extrinsics(pose)
    for i in range(SETS):
        clock[0] += 100 * MS
        for name in names:
            if rng.random() < 0.01:
                away[name] = i + int(rng.integers(5, 40))
            if away[name] > i:
                continue
            # The bag begins anew every LOOP sets, with the stamps that it has.
            stamp = clock[0] - looped * LOOP * 100 * MS
            head = c.header(stamp + int(rng.integers(5 * MS)), f'{name}_optical')
            inputs[name]._on_info(c.camera_info_message(infos[name], head))
            inputs[name]._on_image(c.image_message(images[i % 4], '16UC1', head))
            given += 1
        node.work._on_timer()
        if sent:
            node.work.pace._on_answer(PoseArray(header=c.header(sent[-1], 'table')))
        looped = (i + 1) // LOOP
        if i % 100 == 99:
            memory, objects = allocated()
            used.append((memory, objects - len(sent)))
        bench.executor.spin_once(timeout_sec=0)
    sets = node.work.assembly.sets
    waiting = len(names) - len(sets.missing())
    jumps = sum(n for (_, reason), n in sets.drops.items() if reason == 'time_jump')
    accounted = sets.used.total() + sets.drops.total() + waiting
    # A jump counts even where nothing waited.
    assert given <= accounted <= given + jumps, (given, sets.used, sets.drops)
    assert all(reason in ('superseded', 'spread', 'time_jump')
               for _, reason in sets.drops), sets.drops
    assert looped == 4 and jumps >= 3 and len(sent) > 0.85 * SETS and len(sent) == node.work.number
    # A leak grows from each sample to the next, a buffer now and then.
    memory, objects = np.median(np.diff(used, axis=0)[2:], axis=0)
    # Of every set: 200 bytes, half an object.
    assert memory < 20_000 and objects < 50, used


def held():
    """Return how many entries all containers of this process have."""
    gc.collect()
    return sum(len(each) for each in gc.get_objects()
               if isinstance(each, (list, dict, set, deque)))


def test_hundreds_of_sets_with_drop_outs_and_refusals_through_the_chain(bench, make_chain):
    """Every set is answered or refused for a reason, by the set; and nothing is kept of it."""
    rng, names = np.random.default_rng(0), ('a', 'b', 'c')
    stages, send = make_chain(names, {
        0: {'wait_for_answer_s': 600.0, 'camera_timeout_s': 0.3, 'max_frame_age_s': 0.0,
            'explain_after_s': 0.0}, 3: {'sigmas': False}})
    ingestion = bench.chain[0].work
    clock, away, given, refused = [10 ** 18], dict.fromkeys(names, 0), 0, Counter()
    for node in bench.chain:
        node.now_ns = lambda: clock[0]
    answers, held_by = [0], []

    def count(_):
        answers[0] += 1
    bench.peer.create_subscription(PoseArray, 'objects/poses', count, qos('objects/poses'))

    def settled():
        sets = ingestion.assembly.sets
        heard = sets.used.total() + sets.drops.total() + len(names) - len(sets.missing())
        return heard == given and ingestion.pace.stamp_ns is None
    for i in range(STEPS):
        clock[0] += 100 * MS
        for name in names:
            if rng.random() < 0.02:
                away[name] = i + int(rng.integers(2, 10))
        there = [name for name in names if away[name] <= i]
        stage = str(rng.choice(['classify', 'propose', 'parse'])) if rng.random() < 0.1 else None
        stages.refuse = stage and (stage, HoocError('not this one'))
        before = ingestion.number
        send(only=there, stamp=clock[0])
        given += len(there)
        assert bench.spin(settled), (i, there, stage, [bench.reasons(n) for n in bench.chain])
        refused[stage] += ingestion.number - before
        if i % 50 == 49:
            held_by.append(held())
    assert bench.spin(lambda: answers[0] == refused[None])
    told = {stage: node.diagnostics._counts[stage, 'refused']
            for stage, node in zip(('classify', 'propose', 'parse'), bench.chain[1:])}
    del refused[None]
    assert told == refused and min(told.values()) > 2
    assert bench.chain[0].diagnostics._counts['chain', 'refused'] == refused.total()
    assert ingestion.number == answers[0] + refused.total() > 0.7 * STEPS
    assert not bench.chain[0].diagnostics._counts['chain', 'no_answer']
    # Sets of fewer cameras, and frames that waited for them.
    sets = ingestion.assembly.sets
    assert sets.used['a'] < ingestion.number and sets.drops.total() > 5
    # One entry a set in any of them would be some forty from each sample to the next.
    assert np.median(np.diff(held_by)[1:]) < 20, held_by


@pytest.fixture
def unset(monkeypatch):
    """Take away what the environment says about ROS, for processes of their own."""
    for name in ('ROS_DOMAIN_ID', 'ROS_AUTOMATIC_DISCOVERY_RANGE',
                 environment.TRANSPORTS_VARIABLE, *environment.FAST_DDS_VARIABLES):
        monkeypatch.setenv(name, '')
        monkeypatch.delenv(name)


@pytest.mark.slow
def test_the_chain_of_processes_does_not_grow(repository, cheap, unset, tmp_path):
    from hooc_perception.benchmark.soak import soak
    from hooc_perception.benchmark.soak_result import write_plot
    from hooc_perception.chain import CHAIN
    common = {'model': str(repository / 'models' / 'demo'), 'profile': 'fast'}
    parameters = {name: {**common, **cheap.get(name, {})} for name in CHAIN}
    parameters['ingestion_node']['camera_timeout_s'] = 1.0
    result = soak(repository / 'bags' / 'demo', parameters, 40.0, rate=2.0)
    assert result.deaths == 0 and result.answers >= 5
    # Whatever ingestion sent on was answered, or counted: a machine that still compiles beside
    # other work may take longer than ingestion waits.
    late = result.reasons['ingestion_node: chain', 'no_answer']
    assert result.sets - late - result.refused <= result.answers <= result.sets
    grown = {name: result.growth_mb(name) for name in CHAIN}
    assert max(grown.values()) < 40, grown
    write_plot(tmp_path / 'soak.png', result)
    assert (tmp_path / 'soak.png').stat().st_size > 5000


@pytest.mark.slow
def test_every_change_of_a_table_is_answered_and_ids_stay(repository, unset):
    """The whole chain as processes, with full parses in the background."""
    from hooc_perception.benchmark.changing_table import ChangingTable
    from hooc_perception.benchmark.soak import soak
    from hooc_perception.chain import CHAIN, PARSING
    from hooc_perception.trained.folder import load_model_folder
    model = repository / 'models' / 'demo'
    folder = load_model_folder(model)
    table = ChangingTable(folder.models, folder.cameras, np.random.default_rng(3))
    parameters = {name: {'model': str(model), 'profile': 'fast'} for name in CHAIN}
    parameters[PARSING].update(max_instances=2, full_every_s=5.0)
    # A machine that does other work meanwhile may need longer for the second change.
    for seconds in (60.0, 240.0):
        result = soak(table, parameters, seconds)
        changes = result.changes
        if result.deaths or len(changes.followed) >= 2:
            break
    assert result.deaths == 0 and len(changes.followed) >= 2
    # The last change may have come just before the end.
    assert not changes.lost and all(f.answers for f in changes.followed[:-1]), changes
    assert changes.swapped == 0 and changes.lost_ids == 0, changes
    assert changes.found >= 0.95 * changes.true

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Real processes that are killed in the middle of a scene, and come back by themselves."""

import fcntl
import os
from pathlib import Path
import re
import signal
import time

import pytest

pytest.importorskip('rclpy')

from geometry_msgs.msg import PoseArray  # noqa: E402
from hooc_perception.chain import CHAIN, REPLAY
from hooc_perception.ros.qos import qos
from hooc_perception.supervisor import environment
from hooc_perception.supervisor.shared_memory import free_orphans
from hooc_perception.supervisor.supervisor import Supervisor
from hooc_perception.supervisor.watchdog import Watchdog
from rosgraph_msgs.msg import Clock  # noqa: E402
from visualization_msgs.msg import MarkerArray  # noqa: E402


@pytest.fixture
def own_environment(monkeypatch):
    """Keep what the supervisor puts into the environment from leaking into other tests."""
    for name in ('ROS_DOMAIN_ID', 'ROS_AUTOMATIC_DISCOVERY_RANGE',
                 environment.TRANSPORTS_VARIABLE, *environment.FAST_DDS_VARIABLES):
        monkeypatch.setenv(name, '')
        monkeypatch.delenv(name)


def cheap_chain(root, cheap):
    """Return the parameters of a chain that answers within a second or two."""
    common = {'model': str(root / 'models' / 'demo'), 'profile': 'fast', 'warm_up': False}
    parameters = {name: {**common, **cheap.get(name, {})} for name in CHAIN}
    parameters[REPLAY] = {'bag': str(root / 'bags' / 'demo'), 'loop': True, 'rate': 0.0,
                          'answer_timeout_s': 2.0}
    return parameters


def statuses(node):
    """Return a dict that fills with the latest DiagnosticStatus of each name."""
    from diagnostic_msgs.msg import DiagnosticArray
    latest = {}
    node.create_subscription(DiagnosticArray, '/diagnostics', lambda message: latest.update(
        {status.name: status for status in message.status}), 50)
    return latest


def test_each_node_that_is_killed_comes_back(repository, cheap, own_environment):
    with Supervisor((*CHAIN, REPLAY), cheap_chain(repository, cheap), isolated=True,
                    params_file=repository / 'config' / 'perception.yaml') as supervisor:
        supervisor.bring_up()
        watchdog = Watchdog(supervisor, pause_s=0.1)
        heard, markers, latest = [], [], statuses(supervisor.node)
        supervisor.node.create_subscription(PoseArray, 'objects/poses', heard.append,
                                            qos('objects/poses'))
        supervisor.node.create_subscription(MarkerArray, 'objects/markers', markers.append,
                                            qos('objects/markers'))

        def until(condition, timeout_s=60.0):
            deadline = time.monotonic() + timeout_s
            while not condition() and time.monotonic() < deadline:
                watchdog.spin(0.05)
            return condition()

        def said(name):
            status = latest.get(f'hooc_supervisor: {name}')
            return status and 'SIGKILL' in status.message

        assert until(lambda: heard and heard[-1].poses)
        # A change at run time outlives the process that it was made in.
        supervisor.set_parameters('ingestion_node', {'max_set_spread_s': 0.25})
        for name in CHAIN:
            shown = {(m.ns, m.id) for m in markers[-1].markers if m.action == m.ADD}
            os.kill(supervisor.processes[name].pid, signal.SIGKILL)
            heard.clear()
            markers.clear()
            assert until(lambda: heard and not heard[-1].poses), 'the answer is not taken back'
            assert until(lambda: shown <= {
                (m.ns, m.id) for message in markers for m in message.markers
                if m.action == m.DELETE and m.header.frame_id == 'table'}), markers
            assert until(lambda: said(name)), latest
            assert until(lambda: not watchdog.restarting() and heard[-1].poses), f'no {name}'
        assert watchdog.deaths == dict.fromkeys(CHAIN, 1)
        # The file that the node was started with again says 0.1.
        assert supervisor.get_parameters('ingestion_node', ['max_set_spread_s']) == {
            'max_set_spread_s': 0.25}
        assert until(lambda: 'hooc_supervisor: parsing_node' in latest)


def test_retraction_uses_the_frame_and_the_clock_of_the_dead(own_environment):
    given = {'target_frame': 'bench', 'use_sim_time': True}
    with Supervisor(('parsing_node',), {'parsing_node': given}, isolated=True) as supervisor:
        watchdog, heard = Watchdog(supervisor, pause_s=0.1, hung_s=100.0), []
        supervisor.set_parameters('parsing_node', {'target_frame': 'rig'})
        clock = supervisor.node.create_publisher(Clock, '/clock', 1)
        supervisor.node.create_subscription(PoseArray, 'objects/poses', heard.append,
                                            qos('objects/poses'))
        os.kill(supervisor.processes['parsing_node'].pid, signal.SIGKILL)
        deadline = time.monotonic() + 30
        while time.monotonic() < deadline and not any(
                m.header.stamp.sec == 1000 and m.header.frame_id == 'rig' for m in heard):
            message = Clock()
            message.clock.sec = 1000
            clock.publish(message)
            watchdog.spin(0.02)
        assert heard[-1].header.frame_id == 'rig' and heard[-1].header.stamp.sec == 1000


def test_a_node_that_hangs_is_ended_and_comes_back(own_environment):
    with Supervisor((REPLAY,), {REPLAY: {'bag': 'none'}}, isolated=True) as supervisor:
        watchdog = Watchdog(supervisor, pause_s=0.1, hung_s=2.0)
        first = supervisor.processes[REPLAY].pid

        def spin_until(condition):
            deadline = time.monotonic() + 30
            while not condition() and time.monotonic() < deadline:
                watchdog.spin(0.02)
            assert condition()

        started = time.monotonic()
        spin_until(lambda: time.monotonic() - started > 4.0)
        assert not watchdog.deaths, 'a node that answers is left alone'
        os.kill(first, signal.SIGSTOP)
        spin_until(lambda: supervisor.processes[REPLAY].pid != first)
        assert watchdog.deaths[REPLAY] == 1
        (status,) = (s for s in watchdog.diagnostics.statuses() if s.name.endswith(REPLAY))
        assert 'did not answer for 2 s' in status.message and 'memory' not in status.message


def test_a_node_that_keeps_dying_is_tried_less_and_less_often(own_environment, tmp_path,
                                                              monkeypatch):
    monkeypatch.setenv('PYTHONPATH', str(tmp_path))
    (tmp_path / 'stillborn.py').write_text(
        'import sys\nprint("[ERROR] my disk is full", flush=True)\nsys.exit(3)\n')
    with Supervisor((REPLAY,), isolated=True) as supervisor:
        watchdog = Watchdog(supervisor, pause_s=0.1, longest_s=0.5)
        supervisor._modules[REPLAY] = 'stillborn'
        supervisor.processes[REPLAY].kill()
        deadline = time.monotonic() + 30
        while watchdog.deaths[REPLAY] < 6 and time.monotonic() < deadline:
            watchdog.spin(0.02)
        assert watchdog.deaths[REPLAY] == 6
        assert watchdog._pause_of(REPLAY) == 0.5
        (status,) = (s for s in watchdog.diagnostics.statuses() if s.name.endswith(REPLAY))
        assert status.level == type(status).ERROR and 'my disk is full' in status.message
        assert 'exit code 3' in status.message


def test_only_shared_memory_without_an_owner_is_removed(tmp_path):
    def segment(number):
        path = tmp_path / f'fastrtps_{number:016x}'
        path.write_bytes(bytes(1000))
        path.with_name(path.name + '_el').touch()
        os.utime(path.with_name(path.name + '_el'), (1e9, 1e9))
        return path

    dead, living, other = segment(1), segment(2), tmp_path / 'fastrtps_port7411_el'
    other.touch()
    young = segment(3)
    young.with_name(young.name + '_el').touch()
    with open(living.with_name(living.name + '_el')) as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        assert free_orphans(tmp_path) == 1000
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted(
        [living.name, living.name + '_el', young.name, young.name + '_el', other.name])
    assert not dead.exists()


def test_fast_dds_locks_what_it_lives_in(own_environment, monkeypatch, tmp_path):
    """What the clean-up relies on, with the real library."""
    from hooc_perception.supervisor.shared_memory import FOLDER
    if not FOLDER.is_dir():
        pytest.skip('no shared memory')
    with Supervisor((REPLAY,), isolated=True) as supervisor:
        maps = Path(f'/proc/{supervisor.processes[REPLAY].pid}/maps').read_text()
        made = [path for name in set(re.findall(r'fastrtps_[0-9a-f]{16}(?![0-9a-z_])', maps))
                if (path := FOLDER / f'{name}_el').exists()]
        # Only these: other processes may be about to create theirs.
        for path in made:
            for name in (path.name, path.name.removesuffix('_el')):
                (tmp_path / name).symlink_to(FOLDER / name)
        monkeypatch.setattr('hooc_perception.supervisor.shared_memory.YOUNG_S', 0.0)
        assert made and free_orphans(tmp_path) == 0
        assert all((tmp_path / path.name).is_symlink() for path in made)
        supervisor.state(REPLAY)

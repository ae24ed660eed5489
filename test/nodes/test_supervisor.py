# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Real processes: started, brought to active, watched, ended, however the parent ends."""

import os
from pathlib import Path
import signal
import subprocess
import sys
import time

from hooc_perception.errors import HoocError
import pytest
import yaml

pytest.importorskip('rclpy')

from hooc_perception.supervisor import environment
from hooc_perception.supervisor.supervisor import Supervisor

PARENT = """
import signal
import sys
# As in a script that starts it in the background.
signal.signal(signal.SIGINT, signal.SIG_IGN)
from hooc_perception.supervisor.supervisor import Supervisor
with Supervisor(('replay_node', 'ingestion_node'), isolated=True) as supervisor:
    print(*[p.pid for p in supervisor.processes.values()], flush=True)
    while True:
        supervisor.spin(0.1)
"""


def alive(pid):
    """Return whether a process runs (a zombie does not)."""
    try:
        return Path(f'/proc/{pid}/stat').read_text().rsplit(')', 1)[1].split()[0] != 'Z'
    except (FileNotFoundError, ProcessLookupError):
        return False


def gone(pids, timeout_s=15.0):
    """Wait for processes to end; return those that do not."""
    deadline = time.monotonic() + timeout_s
    while (left := [pid for pid in pids if alive(pid)]) and time.monotonic() < deadline:
        time.sleep(0.1)
    return left


@pytest.fixture(autouse=True)
def quiet_domain(monkeypatch):
    """Keep what `isolate` puts into the environment from leaking into other tests."""
    for name in ('ROS_DOMAIN_ID', 'ROS_AUTOMATIC_DISCOVERY_RANGE',
                 environment.TRANSPORTS_VARIABLE, *environment.FAST_DDS_VARIABLES):
        monkeypatch.delenv(name, raising=False)
        monkeypatch.setenv(name, '')
        monkeypatch.delenv(name)


def without_shared_memory(monkeypatch):
    """Who is killed cannot remove its shared memory, and LOCALHOST insists on some."""
    monkeypatch.setenv(environment.TRANSPORTS_VARIABLE, 'UDPv4')
    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'SUBNET')


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_nothing_is_left_behind(number, monkeypatch):
    without_shared_memory(monkeypatch)
    if sys.platform != 'linux':
        pytest.skip('reads /proc')
    parent = subprocess.Popen([sys.executable, '-c', PARENT], stdout=subprocess.PIPE, text=True,
                              stderr=subprocess.DEVNULL)
    pids = [int(word) for word in parent.stdout.readline().split()]
    assert len(pids) == 2 and all(alive(pid) for pid in pids)
    parent.send_signal(number)
    parent.communicate(timeout=20)
    assert parent.returncode != 0
    assert gone(pids) == []


def test_a_death_is_noticed_and_named(monkeypatch):
    without_shared_memory(monkeypatch)
    with Supervisor(('replay_node',), isolated=True) as supervisor:
        process = supervisor.processes['replay_node']
        os.kill(process.pid, signal.SIGKILL)
        with pytest.raises(HoocError, match='replay_node ended unexpectedly'):
            supervisor.wait(lambda: False, 10.0, 'the death was not noticed')
    assert not alive(process.pid)


def test_failed_transitions_and_refused_parameters_say_why(tmp_path):
    with Supervisor(('replay_node',), isolated=True) as supervisor:
        with pytest.raises(HoocError, match='parameter bag is empty'):
            supervisor.bring_up()
        supervisor.set_parameters('replay_node', {'bag': str(tmp_path / 'none')})
        with pytest.raises(HoocError, match='there is no such bag'):
            supervisor.bring_up()
        with pytest.raises(HoocError, match='replay_node: .*rate'):
            supervisor.set_parameters('replay_node', {'rate': -1.0})


def test_lost_answers_are_asked_for_again(monkeypatch, tmp_path):
    monkeypatch.setattr('hooc_perception.supervisor.services.RETRY_S', 0.3)
    with Supervisor(('replay_node',), isolated=True) as supervisor:
        class Forgetful:
            """A client whose every first call is never answered."""

            def __init__(self, client):
                self.client, self.calls = client, 0

            def call_async(self, request):
                from rclpy.task import Future
                self.calls += 1
                return Future() if self.calls == 1 else self.client.call_async(request)

        forgetful = {key: Forgetful(client)
                     for key, client in supervisor._services.clients.items()}
        supervisor._services.clients = forgetful
        assert supervisor.state('replay_node') == 1
        supervisor.set_parameters('replay_node', {'rate': 2.0})
        assert supervisor.get_parameters('replay_node', ['rate']) == {'rate': 2.0}
        with pytest.raises(HoocError, match='parameter bag is empty'):
            supervisor.bring_up()
        assert [c.calls >= 2 for c in forgetful.values()] == [True] * 4


def test_a_broken_parameter_file_ends_in_a_sentence(tmp_path):
    bad = tmp_path / 'bad.yaml'
    bad.write_text('/**:\n  ros__parameters:\n    rate: fast\n')
    with pytest.raises(HoocError, match='rate'):
        with Supervisor(('replay_node',), isolated=True, params_file=bad):
            pass
    with pytest.raises(HoocError, match='no such file'):
        Supervisor(('replay_node',), params_file=tmp_path / 'missing.yaml')


def test_the_shipped_parameter_file_is_accepted(repository):
    with Supervisor(('replay_node', 'ingestion_node'), isolated=True,
                    params_file=repository / 'config' / 'perception.yaml'):
        pass


@pytest.mark.parametrize('order', [1, -1])
def test_what_is_asked_for_wins_over_every_section_of_the_users_file(tmp_path, order):
    """In ROS, the section that is first named last wins, even over -p."""
    sections = {'/**': {'rate': 1.0, 'answer_timeout_s': 11.0, 'bag': 'theirs'},
                '/**/replay_node': {'rate': 2.0, 'match_timeout_s': 12.0},
                '/hooc/replay_node': {'rate': 3.0},
                '/**/ingestion_node': {'wait_for_subscribers': 7}}
    path = tmp_path / 'p.yaml'
    path.write_text(yaml.safe_dump(
        {name: {'ros__parameters': values} for name, values in list(sections.items())[::order]},
        sort_keys=False))
    with Supervisor(('replay_node',), {'replay_node': {'rate': 5.0}}, isolated=True,
                    params_file=path, defaults={'replay_node': {
                        'bag': 'ours', 'wait_for_subscribers': 4, 'rate': 6.0}}) as supervisor:
        assert supervisor.get_parameters('replay_node', [
            'rate', 'answer_timeout_s', 'match_timeout_s', 'bag', 'wait_for_subscribers']) == {
                'rate': 5.0, 'answer_timeout_s': 11.0, 'match_timeout_s': 12.0, 'bag': 'theirs',
                'wait_for_subscribers': 4}


def test_values_arrive_with_their_types():
    """What looks like a number or a truth value in YAML stays text, and 5.0 a float."""
    given = {'model': '1e3', 'target_frame': 'on', 'cameras': ['7', '~', 'a: b', 'Grüße 😀'],
             'max_frame_age_s': 5.0, 'min_cameras': 2, 'warm_up': False}
    with Supervisor(('ingestion_node',), {'ingestion_node': given}, isolated=True) as supervisor:
        assert supervisor.get_parameters('ingestion_node', given) == given


@pytest.mark.parametrize('namespace, full', [
    ('/hooc', '/hooc'), ('robot1/', '/robot1'), ('', '/'), ('/a/b_2', '/a/b_2'), ('a b', None),
    ('/2nd', None), ('/a//b', None), ('kinect-1', None)])
def test_a_namespace_that_ros_refuses_is_named_before_anything_starts(namespace, full):
    if full:
        assert Supervisor(namespace=namespace).namespace == full
        return
    with pytest.raises(HoocError, match='the namespace .* cannot be used: give letters'):
        Supervisor(namespace=namespace)


def test_parallel_runs_get_domains_of_their_own():
    claims = [environment.claim_domain() for _ in range(20)]
    assert len({domain for domain, _ in claims}) == 20
    for _, claim in claims:
        claim.close()


def test_a_domain_of_the_user_is_respected(monkeypatch):
    monkeypatch.setenv('ROS_DOMAIN_ID', '77')
    assert environment.isolate() is None
    assert os.environ['ROS_DOMAIN_ID'] == '77'


def test_large_segments_only_where_there_is_room(monkeypatch, tmp_path):
    monkeypatch.setattr(environment, 'SHARED_MEMORY', tmp_path / 'none')
    assert not environment.use_large_segments()
    monkeypatch.setattr(environment, 'SHARED_MEMORY', tmp_path)
    monkeypatch.setattr(environment, 'SEGMENT_BYTES', 2 ** 60)
    assert not environment.use_large_segments()
    monkeypatch.setattr(environment, 'SEGMENT_BYTES', 1)
    assert environment.use_large_segments()
    assert Path(os.environ['FASTDDS_DEFAULT_PROFILES_FILE']).is_file()
    assert not environment.use_large_segments(), "a profile that is set is the user's"

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""A node's process ends without a trace on the terminal, whenever it is asked to."""

import signal
import subprocess
import sys
import time

import pytest

pytest.importorskip('rclpy')

from hooc_perception.ros.lifecycle.spin import raise_interrupt
from hooc_perception.supervisor.processes import NodeProcess

HEAD = """
import sys
import rclpy.node
from rclpy.impl.implementation_singleton import rclpy_implementation
from hooc_perception.ros.lifecycle.spin import run_node
"""
SHUT_DOWN = HEAD + """
def between_two_waits():
    context = rclpy.utilities.get_default_context()
    rclpy.shutdown()
    with context.handle:
        rclpy_implementation.WaitSet(0, 0, 0, 0, 0, 0, context.handle)
sys.exit(run_node(between_two_waits))
"""
BROKEN = HEAD + """
def broken():
    raise rclpy_implementation.RCLError('out of memory')
sys.exit(run_node(broken))
"""
SPINS = HEAD + """
class Node(rclpy.node.Node):
    def __init__(self):
        super().__init__('spins')
        self.create_timer(0.01, self.say)
    def say(self):
        print('up', flush=True)
    def leave(self):
        print('leaves', flush=True)
    def destroy_node(self):
        print('ends', flush=True)
        import time
        time.sleep(1.0)
        super().destroy_node()
sys.exit(run_node(Node))
"""

STUCK = HEAD + """
import ctypes
from hooc_perception.ros.lifecycle import spin
spin.END_GRACE_S = 1
class Node(rclpy.node.Node):
    def __init__(self):
        super().__init__('stuck')
        self.create_timer(0.01, self.end)
    def end(self):
        raise KeyboardInterrupt
    def leave(self):
        pass
    def destroy_node(self):
        ctypes.PyDLL(None).sleep(50)    # with the interpreter's lock, as Fast DDS can
sys.exit(run_node(Node))
"""


def run(code):
    """Return the CompletedProcess of Python code."""
    return subprocess.run([sys.executable, '-c', code], capture_output=True, text=True,
                          timeout=60)


def test_a_context_that_is_gone_between_two_calls_is_an_orderly_end():
    done = run(SHUT_DOWN)
    assert (done.returncode, done.stderr) == (0, '')
    done = run(BROKEN)
    assert done.returncode == 1 and 'out of memory' in done.stderr


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_signals_end_a_node_quietly_also_when_repeated(number):
    process = subprocess.Popen([sys.executable, '-c', SPINS], stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE, text=True)
    assert process.stdout.readline() == 'up\n'
    process.send_signal(number)
    assert 'leaves\n' in iter(process.stdout.readline, '')
    assert process.stdout.readline() == 'ends\n'
    process.send_signal(number)
    _, said = process.communicate(timeout=30)
    assert (process.returncode, said) == (0, '')


def test_a_node_that_cannot_be_destroyed_does_not_stay():
    began = time.monotonic()
    assert run(STUCK).returncode == -signal.SIGALRM
    assert time.monotonic() - began < 40


def test_an_interrupt_of_compiled_code_is_one():
    """As CPython words it where a signal comes while a kernel of numba runs."""
    error = SystemError('returned a result with an exception set')
    error.__cause__ = KeyboardInterrupt()
    with pytest.raises(KeyboardInterrupt):
        raise_interrupt(error)
    raise_interrupt(ValueError('something else'))


def stopped(tmp_path, monkeypatch, code):
    """Return the exit code of a NodeProcess that is stopped once it has said `here`."""
    # A shell that starts tests in the background has their children ignore Ctrl-C.
    old = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        (tmp_path / 'stand_in.py').write_text(code)
        monkeypatch.setenv('PYTHONPATH', str(tmp_path))
        process = NodeProcess('replay_node', {}, '/hooc', module='stand_in')
    finally:
        signal.signal(signal.SIGINT, old)
    deadline = time.monotonic() + 30
    while process.last_words() != 'here' and time.monotonic() < deadline:
        time.sleep(0.01)
    process.ask_to_stop()
    process.stop(time.monotonic() + 10)
    return process.exit_code()


def test_who_is_stopped_while_it_imports_says_nothing(tmp_path, monkeypatch, capsys):
    code = stopped(tmp_path, monkeypatch, 'import time\nprint("here", flush=True)\n'
                   'time.sleep(60)\n')
    assert code == -signal.SIGTERM
    assert capsys.readouterr().err == '[replay_node] here\n'


def test_of_who_is_stopped_only_what_it_logs_is_passed_on(tmp_path, monkeypatch, capsys):
    stopped(tmp_path, monkeypatch, """
import signal, sys, time
def end(*_):
    print('[ERROR] the disk is full')
    raise ValueError('noise')
signal.signal(signal.SIGTERM, end)
print('here', flush=True)
time.sleep(60)
""")
    assert capsys.readouterr().err == (
        '[replay_node] here\n[replay_node] [ERROR] the disk is full\n')

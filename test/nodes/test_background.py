# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Computations in a process of their own: results, failures, and giving them up."""

from functools import partial
import operator
import os
import signal
import subprocess
import sys
import time

from hooc_perception.errors import HoocError
from hooc_perception.nodes.background import Background
from hooc_perception.trained.folder import load_model_folder
import psutil
import pytest


def ended(background, seconds=60.0):
    """Wait for the end of a Background; return it."""
    deadline = time.monotonic() + seconds
    while not background.is_done and time.monotonic() < deadline:
        time.sleep(0.02)
    assert background.is_done
    return background


def test_a_function_is_called_elsewhere_and_its_value_comes_back():
    assert ended(Background(partial(operator.add, b'x' * 10 ** 6, b'y'))).result() == (
        b'x' * 10 ** 6 + b'y')
    assert ended(Background(os.getpid)).result() != os.getpid()


def test_what_is_printed_does_not_disturb_the_value(capfd):
    assert ended(Background(partial(print, 'hello'))).result() is None
    assert 'hello' in capfd.readouterr().err


@pytest.mark.parametrize('work, reason', [
    (partial(int, 'x'), 'unexpected ValueError: invalid literal'),
    (partial(load_model_folder, '/nowhere'), '/nowhere'),
    (partial(os._exit, 3), r'ended early \(exit code 3\)'),
    (partial(signal.raise_signal, signal.SIGKILL), 'too little memory'),
    (lambda: 1, 'pickle'),
    (partial(open, os.devnull), 'cannot pickle')])
def test_a_failure_is_a_sentence(work, reason):
    with pytest.raises(HoocError, match=reason) as error:
        ended(Background(work)).result()
    assert '\n' not in str(error.value)


def test_what_is_given_up_ends_at_once():
    background = Background(partial(time.sleep, 600))
    assert not background.is_done
    background.discard()
    with pytest.raises(HoocError):
        ended(background, 10.0).result()


@pytest.mark.parametrize('how', ['pass', 'os.kill(os.getpid(), 9)'])
def test_it_ends_with_the_node_however_that_ends(how):
    code = ('from functools import partial; import os, time; '
            'from hooc_perception.nodes.background import Background; '
            'work = Background(partial(time.sleep, 600)); '
            f'print(work._process.pid, flush=True); {how}')
    number = int(subprocess.run([sys.executable, '-c', code], timeout=60, text=True,
                                stdout=subprocess.PIPE).stdout)
    deadline = time.monotonic() + 30
    while psutil.pid_exists(number) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert not psutil.pid_exists(number)


def test_its_process_needs_no_ros():
    code = ('import sys, hooc_perception.nodes.background, hooc_perception.nodes.following; '
            'assert "rclpy" not in sys.modules')
    subprocess.run([sys.executable, '-c', code], check=True)

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The command line's frame: overview, laziness, errors as one sentence, exit codes."""

import importlib
import subprocess
import sys
import types

from hooc_perception.cli import main as cli
from hooc_perception.errors import HoocError
import pytest


def install(monkeypatch, run):
    """Put a stand-in for `hooc demo` in place that does `run(args)`."""
    module = types.ModuleType('hooc_perception.cli.demo')
    module.__spec__ = importlib.machinery.ModuleSpec(module.__name__, None)
    module.HELP = 'Stand-in.'
    module.add_arguments = lambda parser: parser.add_argument('--number', type=int, default=3)
    module.run = run
    monkeypatch.setitem(sys.modules, module.__name__, module)


def test_overview_lists_the_commands(capsys):
    with pytest.raises(SystemExit) as stop:
        cli.main(['--help'])
    assert stop.value.code == 0
    text = capsys.readouterr().out
    assert cli.available()
    for name in cli.available():
        assert cli.COMMANDS[name] in ' '.join(text.split())


def test_overview_imports_nothing_heavy():
    code = ('import sys; from hooc_perception.cli.main import main\n'
            'try: main(["--help"])\nexcept SystemExit: pass\n'
            'heavy = {"numpy", "numba", "scipy", "rclpy", "open3d"} & set(sys.modules)\n'
            'sys.exit(bool(heavy))')
    assert subprocess.run([sys.executable, '-c', code], stdout=subprocess.DEVNULL).returncode == 0


@pytest.mark.parametrize('name', list(cli.COMMANDS))
def test_every_command_explains_itself(name, capsys):
    if name not in cli.available():
        pytest.skip(f'{name} is not part of this installation')
    module = importlib.import_module(f'hooc_perception.cli.{name}')
    assert module.HELP.strip()
    with pytest.raises(SystemExit) as stop:
        cli.main([name, '--help'])
    assert stop.value.code == 0
    assert f'hooc {name}' in capsys.readouterr().out


def test_arguments_reach_the_command(monkeypatch):
    seen = []
    install(monkeypatch, lambda args: seen.append(args.number))
    assert cli.main(['demo', '--number', '7']) == 0
    assert seen == [7]


def test_exit_code_is_the_commands(monkeypatch):
    install(monkeypatch, lambda args: 5)
    assert cli.main(['demo']) == 5


def fail_with(error):
    """Return a run function that raises `error`."""
    def run(args):
        raise error
    return run


def test_user_errors_are_one_sentence(monkeypatch, capsys):
    install(monkeypatch, fail_with(HoocError('the set lacks cameras; add cameras.yaml')))
    assert cli.main(['demo']) == 1
    assert capsys.readouterr().err == 'hooc: the set lacks cameras; add cameras.yaml\n'


@pytest.mark.parametrize('error', [RuntimeError('two\nlines'), FileNotFoundError(2, 'gone', 'x'),
                                   ValueError()])
def test_other_errors_are_one_line_without_a_trace(monkeypatch, capsys, error):
    install(monkeypatch, fail_with(error))
    assert cli.main(['demo']) == 1
    text = capsys.readouterr().err
    assert text.count('\n') == 1
    assert type(error).__name__ in text
    assert '--debug' in text


def test_a_missing_extra_is_named_in_one_sentence(monkeypatch, capsys):
    install(monkeypatch, fail_with(ModuleNotFoundError("No module named 'mujoco'", name='mujoco')))
    assert cli.main(['demo']) == 1
    assert capsys.readouterr().err == (
        "hooc: mujoco is not installed; run: pip install 'hooc_perception[train]'\n")


@pytest.mark.parametrize('argv', [['--debug', 'demo'], ['demo', '--debug']])
def test_debug_shows_the_trace(monkeypatch, argv):
    install(monkeypatch, fail_with(RuntimeError('why')))
    with pytest.raises(RuntimeError, match='why'):
        cli.main(argv)


def test_interrupt(monkeypatch, capsys):
    install(monkeypatch, fail_with(KeyboardInterrupt()))
    assert cli.main(['demo']) == 130
    assert 'Traceback' not in capsys.readouterr().err


def test_unknown_command_names_the_known_ones(capsys):
    with pytest.raises(SystemExit) as stop:
        cli.main(['dance'])
    assert stop.value.code == 2
    assert 'dance' in capsys.readouterr().err


def test_no_command_shows_the_overview(capsys):
    assert cli.main([]) == 2
    assert 'typical order' in capsys.readouterr().out


def test_a_command_whose_module_is_missing_is_not_offered(monkeypatch):
    monkeypatch.setitem(cli.COMMANDS, 'dance', 'step')
    assert 'dance' not in cli.available()


def test_a_reader_that_leaves_early_is_no_error():
    run = subprocess.run(f'"{sys.executable}" -m hooc_perception.cli.main --help | head -1',
                         shell=True, capture_output=True, text=True)
    assert 'usage: hooc' in run.stdout
    assert 'Traceback' not in run.stderr

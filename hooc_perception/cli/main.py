# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
The command line `hooc`.

Each sub-command is a module `hooc_perception.cli.<name>` with `HELP` (str),
`add_arguments(parser)` and `run(args) -> int | None`; `bench`, a package, has sub-commands of
its own. Only the chosen module is imported, so that `hooc --help` answers at once.
"""

from argparse import ArgumentParser, RawDescriptionHelpFormatter
from collections.abc import Sequence
import importlib
from importlib.util import find_spec
import os
import sys
from typing import TextIO
import warnings

from hooc_perception.cli import options
from hooc_perception.errors import HoocError, HoocWarning
from hooc_perception.extras import advice

# One line each, kept here so that the overview imports none of the commands.
COMMANDS = {
    'demo': 'replay the bundled scene through the five nodes and show what was found',
    'convert': 'write a scene set or BOP dataset as rosbag2 bags, one per scene',
    'train': "train a model from a set's generic meshes and cameras, never its scenes",
    'parse': 'find the objects of a scene set or a bag in one process, without ROS',
    'run': 'find the objects of recorded bags through the five nodes',
    'up': 'start the nodes for live cameras, until interrupted',
    'replay': 'play a bag as live cameras',
    'evaluate': "score results against ground truth: the paper's Tables 1-4, stricter scores",
    'baseline': 'run a standard method (FPFH or PPF) on a scene set, to compare with',
    'stages': 'show what classifier, candidates and parsing lose',
    'worst': 'plot the worst-localized scenes and list why objects were missed',
    'export': "write results in BOP's CSV format",
    'report': 'write results as one self-contained HTML page with overlays',
    'twin': 'write a synthetic benchmark set',
    'doctor': 'diagnose an installation or a bag and suggest fixes',
    'calibrate': 'refine the poses of fixed cameras against each other and the table',
    'bench': 'measure speed and memory; fuzz and soak tests',
}
# The sub-command that runs where a command has several and none is named.
DEFAULT_TOOLS = {'bench': 'speed'}

EPILOG = """\
typical order:
  hooc train SET --out MODEL                     from meshes and cameras alone
  hooc parse SET --model MODEL --out results.json
  hooc evaluate SET results.json
  hooc report results.json

`hooc COMMAND --help` explains a command. The exit code is 0 only on success.
"""


def available() -> list[str]:
    """Return the names of the commands whose module is installed, in the order of the help."""
    return [name for name in COMMANDS if find_spec(f'hooc_perception.cli.{name}')]


def build_parser(chosen: str | None = None) -> ArgumentParser:
    """
    Return the argument parser.

    :param chosen: name of the one command whose module is imported to declare its arguments;
        None declares none of them.
    """
    parser = ArgumentParser(
        prog='hooc', description='Categories and 6D poses of the objects on a table, from depth.',
        epilog=EPILOG, formatter_class=RawDescriptionHelpFormatter)
    parser.add_argument('--debug', action='store_true', help='show the traceback of an error')
    parser.add_argument('--version', action='store_true', help='print the version and exit')
    subparsers = parser.add_subparsers(dest='command', metavar='COMMAND', title='commands')
    for name in available():
        module = importlib.import_module(f'hooc_perception.cli.{name}') if name == chosen else None
        sub = subparsers.add_parser(name, help=COMMANDS[name],
                                    description=module.HELP if module else COMMANDS[name])
        if module:
            options.add_debug(sub)
            module.add_arguments(sub)
            if name not in DEFAULT_TOOLS:
                sub.set_defaults(run=module.run)
    return parser


def version() -> str:
    """Return the package's version as it is installed."""
    from importlib.metadata import PackageNotFoundError
    from importlib.metadata import version as installed
    try:
        return installed('hooc_perception')
    except PackageNotFoundError:
        return 'unknown (not installed)'


def with_default_tool(words: Sequence[str]) -> list[str]:
    """Return the words of a command line with `bench` completed to `bench speed`."""
    command = next((word for word in words if word != '--debug'), None)
    if command not in DEFAULT_TOOLS:
        return list(words)
    at = words.index(command) + 1
    following = next((word for word in words[at:] if word != '--debug'), None)
    if following is not None and (not following.startswith('-')
                                  or following in ('-h', '--help')):
        return list(words)
    return [*words[:at], DEFAULT_TOOLS[command], *words[at:]]


def dispatch(argv: Sequence[str]) -> int:
    """Run the command that `argv` names; return its exit code."""
    # Options of the whole program take no value, so the first other word is the command.
    chosen = next((word for word in argv if not word.startswith('-')), None)
    parser = build_parser(chosen)
    args = parser.parse_args(with_default_tool(argv))
    if args.version:
        print(version())
        return 0
    if args.command is None:
        parser.print_help()
        return 2
    code = args.run(args) or 0
    sys.stdout.flush()
    return code


def show_warning(message: Warning | str, category: type[Warning], filename: str, lineno: int,
                 file: TextIO | None = None, line: str | None = None) -> None:
    """Print our own warnings as one sentence, those of libraries as Python does."""
    text = (f'[WARN] {message}\n' if issubclass(category, HoocWarning) else
            warnings.formatwarning(message, category, filename, lineno, line))
    (file or sys.stderr).write(text)


def main(argv: Sequence[str] | None = None) -> int:
    """
    Run the command line and return the exit code.

    Errors end as one sentence on standard error and code 1, an interrupt as code 130; the
    traceback is shown only with --debug.
    """
    argv = sys.argv[1:] if argv is None else list(argv)
    try:
        with warnings.catch_warnings():
            warnings.showwarning = show_warning
            return dispatch(argv)
    except KeyboardInterrupt:
        print('hooc: interrupted', file=sys.stderr)
        return 130
    except BrokenPipeError:
        # The reader (head, less) has left; keep Python from complaining at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 141
    except Exception as error:
        if '--debug' in argv:
            raise
        hint = advice(error) if isinstance(error, ImportError) else None
        if isinstance(error, HoocError) or hint:
            print(f'hooc: {hint or error}', file=sys.stderr)
        else:
            text = ' '.join(str(error).split()) or 'no message'
            print(f'hooc: unexpected {type(error).__name__}: {text} '
                  '(run again with --debug to see the traceback)', file=sys.stderr)
        return 1


if __name__ == '__main__':
    sys.exit(main())

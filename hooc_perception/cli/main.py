# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
The command line `hooc`.

Each sub-command is a module `hooc_perception.cli.<name>` with `HELP` (str),
`add_arguments(parser)` and `run(args) -> int | None`. Only the chosen module is imported, so
that `hooc --help` answers at once.
"""

import argparse
import importlib
from importlib.util import find_spec
import os
import sys

from hooc_perception.errors import HoocError
from hooc_perception.extras import advice

# One line each, kept here so that the overview imports none of the commands.
COMMANDS = {
    'demo': 'replay the bundled scene through the five nodes, show what was found',
    'convert': 'write a scene set or BOP dataset as rosbag2 bags, one a scene',
    'train': "train a model from a set's generic meshes and cameras, never its scenes",
    'parse': 'parse a scene set in one process, without ROS',
    'run': 'parse replayed bags through the five nodes',
    'up': 'start the nodes for live cameras, until interrupted',
    'replay': 'play a bag as live cameras',
    'evaluate': 'score results against the truth: Tables 1-4 and the stricter scores',
    'report': 'write results as one self-contained HTML page with overlays',
    'twin': 'write the synthetic benchmark set',
    'doctor': 'say what is wrong with an installation or a bag, and the mend',
    'bench': 'measure every stage against named baselines in one run',
}

EPILOG = """\
typical order:
  hooc train SET --out MODEL                     from meshes and cameras alone
  hooc parse SET --model MODEL --out results.json
  hooc evaluate SET results.json
  hooc report results.json

`hooc COMMAND --help` explains a command. The exit code is 0 only on success.
"""


def available():
    """Return the names of the commands whose module is installed, in the order of the help."""
    return [name for name in COMMANDS if find_spec(f'hooc_perception.cli.{name}')]


def build_parser(chosen=None):
    """
    Return the argument parser.

    :param chosen: name of the one command whose module is imported to declare its arguments;
        None declares none of them.
    """
    parser = argparse.ArgumentParser(
        prog='hooc', description='Categories and 6D poses of everything on a table, from depth.',
        epilog=EPILOG, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--debug', action='store_true', help='show the trace of an error')
    parser.add_argument('--version', action='store_true', help='print the version and exit')
    subparsers = parser.add_subparsers(dest='command', metavar='COMMAND', title='commands')
    for name in available():
        module = importlib.import_module(f'hooc_perception.cli.{name}') if name == chosen else None
        sub = subparsers.add_parser(name, help=COMMANDS[name],
                                    description=module.HELP if module else COMMANDS[name])
        if module:
            sub.add_argument('--debug', action='store_true', default=argparse.SUPPRESS,
                             help='show the trace of an error')
            module.add_arguments(sub)
            sub.set_defaults(run=module.run)
    return parser


def version():
    """Return the package's version; its one source is package.xml."""
    from importlib.metadata import PackageNotFoundError
    from importlib.metadata import version as installed
    try:
        return installed('hooc_perception')
    except PackageNotFoundError:
        return 'unknown (not installed)'


def dispatch(argv):
    """Run the command that `argv` (list of str) names; return its exit code."""
    # Options of the whole program take no value, so the first other word is the command.
    chosen = next((word for word in argv if not word.startswith('-')), None)
    parser = build_parser(chosen)
    args = parser.parse_args(argv)
    if args.version:
        print(version())
        return 0
    if args.command is None:
        parser.print_help()
        return 2
    code = args.run(args) or 0
    sys.stdout.flush()
    return code


def main(argv=None):
    """
    Run the command line and return the exit code.

    Errors end as one sentence on standard error and code 1, an interrupt as code 130; a trace
    is shown only with --debug.
    """
    argv = sys.argv[1:] if argv is None else list(argv)
    try:
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
                  '(run again with --debug to see the trace)', file=sys.stderr)
        return 1


if __name__ == '__main__':
    sys.exit(main())

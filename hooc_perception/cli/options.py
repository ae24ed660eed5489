# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Options that several commands share, and options of earlier versions that have moved."""

from argparse import Action, ArgumentParser, Namespace, SUPPRESS
from pathlib import Path
from typing import Any

from hooc_perception.chain import PROFILES
from hooc_perception.errors import HoocError


def add_debug(parser: ArgumentParser) -> None:
    """Declare `--debug` of a command, which `main` looks for wherever it stands."""
    parser.add_argument('--debug', action='store_true', default=SUPPRESS,
                        help='show the traceback of an error')


def add_executor(parser: ArgumentParser) -> None:
    """Declare `--executor`, for commands whose work can be distributed (executor.py)."""
    parser.add_argument('--executor', default='local', metavar='WHERE',
                        help='local = the cores of this machine (default), dask=ADDRESS = the '
                        'workers of the Dask scheduler at that address, such as '
                        'dask=tcp://10.0.0.1:8786; the result is the same')


def add_scene(parser: ArgumentParser) -> None:
    """Declare `--scene`, for commands that can be restricted to some scenes of a set."""
    parser.add_argument('--scene', metavar='ID', action='append', default=[],
                        help='only this scene (repeatable)')


def add_chain(parser: ArgumentParser) -> None:
    """Declare what decides how the chain works: model, profile, seed, single parameters."""
    parser.add_argument('--model', type=Path, required=True, metavar='MODEL',
                        help='model folder written by hooc train')
    add_profile(parser, None)
    parser.add_argument('--seed', type=int, help="default: the model's")
    parser.add_argument('--set-parameter', action='append', default=[], metavar='STAGE.NAME=VALUE',
                        help='change one parameter of the profile (repeatable)')


def add_profile(parser: ArgumentParser, default: str | None) -> None:
    """Declare `--profile`; no default stands for the profile that the model was trained for."""
    parser.add_argument('--profile', choices=PROFILES, default=default,
                        help='default: %(default)s' if default else
                        'default: the profile the model was trained for')


def add_moved(parser: ArgumentParser, moved: dict[str, str]) -> None:
    """
    Declare options of earlier versions, so that they are answered by one sentence.

    :param moved: {option: what to write instead}.
    """
    for option, instead in moved.items():
        parser.add_argument(option, action=_Moved, nargs='?', const=instead, default=SUPPRESS,
                            help=SUPPRESS)


class _Moved(Action):
    """An option that has moved: naming it raises HoocError with the new form."""

    def __call__(self, parser: ArgumentParser, namespace: Namespace, values: Any,
                 option_string: str | None = None) -> None:
        raise HoocError(f'{self.option_strings[0]} has moved; use {self.const}')

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""`hooc bench`: four measurements, each a sub-command of its own."""

from argparse import ArgumentParser
from importlib import import_module

from hooc_perception.cli import options

HELP = ('Measure speed and memory, how they grow, and what damaged input and long runs do. '
        '`hooc bench` alone is `hooc bench speed`.')
TOOLS = {
    'speed': 'speed and memory of every stage, as ratios to named baselines in the same run',
    'growth': 'how time and memory grow with views, categories, objects, pixels and changes',
    'fuzz': 'feed damaged bags, messages and models to everything that reads them',
    'soak': 'run the nodes for a long time while cameras drop out and return',
}


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the sub-commands with their arguments."""
    tools = parser.add_subparsers(dest='tool', metavar='TOOL', title='tools', required=True)
    for name, text in TOOLS.items():
        module = import_module(f'{__name__}.{name}')
        tool = tools.add_parser(name, help=text, description=module.HELP)
        options.add_debug(tool)
        module.add_arguments(tool)
        tool.set_defaults(run=module.run)

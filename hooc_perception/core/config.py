# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
How a parameter is declared: once, as a dataclass field with meaning, unit and range.

Each stage keeps its own frozen dataclass in its own module, built from `param` and derived
from `Config`; ROS descriptors, YAML checks and the docs are read off the fields.
"""

from dataclasses import dataclass, field, fields

from hooc_perception.errors import HoocError


def param(default, doc, unit='', low=None, high=None, choices=None, runtime=False):
    """
    Declare one parameter.

    :param doc: one sentence: what it means and, where the paper is silent, why this value.
    :param low: smallest allowed value, `high` the largest; None = open.
    :param choices: the allowed values of a string.
    :param runtime: True where a running node may change it.
    """
    return field(default=default, metadata={'doc': doc, 'unit': unit, 'low': low, 'high': high,
                                            'choices': choices, 'runtime': runtime})


@dataclass(frozen=True)
class Config:
    """Base of every stage's parameters: checks types and ranges when it is made."""

    def __post_init__(self):
        """Raise HoocError, naming the parameter, where a value is out of its range."""
        for f in fields(self):
            value, m = getattr(self, f.name), f.metadata
            kind = type(f.default)
            if kind is float and isinstance(value, int) and not isinstance(value, bool):
                value = float(value)
                object.__setattr__(self, f.name, value)
            if type(value) is not kind:
                raise HoocError(f'parameter {f.name} is {value!r}, but must be of type '
                                f'{kind.__name__}')
            if value != value:
                raise HoocError(f'parameter {f.name} is not a number; give one')
            if m.get('choices') and value not in m['choices']:
                raise HoocError(f'parameter {f.name} is {value!r}; choose one of '
                                f'{", ".join(m["choices"])}')
            if (m.get('low') is not None and value < m['low']) or (
                    m.get('high') is not None and value > m['high']):
                raise HoocError(f'parameter {f.name} is {value}, outside its range '
                                f'{m.get("low")} to {m.get("high")}')

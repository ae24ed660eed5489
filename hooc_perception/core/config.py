# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
How a parameter is declared: once, as a dataclass field with meaning, unit and range.

Each stage keeps its own frozen dataclass in its own module, built from `param` and derived from
`Config`; ROS descriptors, YAML checks and the docs are read off the fields. A Config may hold
others (`group`). Users see one flat list of names per stage: `parse.tolerance_m` sets
`ParseConfig.pixels.tolerance_m`.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, Field, field, fields, replace
from typing import Any, Self, TypeVar

from hooc_perception.errors import HoocError

T = TypeVar('T')
C = TypeVar('C', bound='Config')


def param(default: T, doc: str, unit: str = '', low: float | None = None,
          high: float | None = None, choices: tuple[str, ...] | None = None,
          runtime: bool = False) -> T:
    """
    Declare one parameter.

    :param doc: one sentence: what it means and, where the paper is silent, why this value.
    :param low: smallest allowed value, `high` the largest; None = open.
    :param choices: the allowed values of a string.
    :param runtime: True where a running node may change it.
    :return: a dataclass field; typed as its default, as `dataclasses.field` is.
    """
    declared: Any = field(default=default, metadata={
        'doc': doc, 'unit': unit, 'low': low, 'high': high, 'choices': choices,
        'runtime': runtime})
    return declared


def group(default: C) -> C:
    """Declare a Config inside of a Config; its parameters belong to the outer one's names."""
    declared: Any = field(default=default, metadata={'group': True})
    return declared


@dataclass(frozen=True)
class Config:
    """Base of every stage's parameters: checks types and ranges when it is made."""

    def __post_init__(self) -> None:
        """Raise HoocError, naming the parameter, where a value is out of its range."""
        for f in fields(self):
            if not f.metadata.get('group'):
                object.__setattr__(self, f.name, _checked(f, getattr(self, f.name)))

    @classmethod
    def parameters(cls) -> dict[str, 'Field[Any]']:
        """
        Return {name: dataclass field} of all parameters, those of groups included.

        A group's defaults may differ from those of its class: see `values`.
        """
        found: dict[str, Field[Any]] = {}
        for f in fields(cls):
            default: Any = f.default
            inner = default.parameters() if f.metadata.get('group') else {f.name: f}
            twice = found.keys() & inner.keys()
            assert not twice, f'{cls.__name__} declares {twice} twice'
            found.update(inner)
        return found

    def values(self) -> dict[str, Any]:
        """Return {name: value} of all parameters, those of groups included."""
        return dict(self._values())

    def changed(self, values: Mapping[str, Any]) -> Self:
        """
        Return a copy with some parameters changed, wherever they are declared.

        :param values: {name: value}.
        :raises HoocError: where there is no such parameter or a value is out of its range.
        """
        unknown = sorted(values.keys() - self.parameters().keys())
        if unknown:
            raise HoocError(f'there is no parameter {unknown[0]!r}')
        own: dict[str, Any] = {}
        for f in fields(self):
            if f.metadata.get('group'):
                inner: Config = getattr(self, f.name)
                mine = {k: v for k, v in values.items() if k in inner.parameters()}
                if mine:
                    own[f.name] = inner.changed(mine)
            elif f.name in values:
                own[f.name] = values[f.name]
        return replace(self, **own)

    def _values(self) -> Iterator[tuple[str, Any]]:
        for f in fields(self):
            value = getattr(self, f.name)
            if f.metadata.get('group'):
                yield from value.values().items()
            else:
                yield f.name, value


def _checked(f: 'Field[Any]', value: Any) -> Any:
    """Return the value of a parameter as the type of its default; HoocError if it is not."""
    m, kind = f.metadata, type(f.default)
    if kind is float and isinstance(value, int) and not isinstance(value, bool):
        value = float(value)
    if type(value) is not kind:
        raise HoocError(f'parameter {f.name} is {value!r}, but must be of type {kind.__name__}')
    if value != value:
        raise HoocError(f'parameter {f.name} is not a number; give one')
    if m.get('choices') and value not in m['choices']:
        raise HoocError(f'parameter {f.name} is {value!r}; choose one of '
                        f'{", ".join(m["choices"])}')
    low, high = m.get('low'), m.get('high')
    if (low is not None and value < low) or (high is not None and value > high):
        raise HoocError(f'parameter {f.name} is {value}, outside its range {low} to {high}')
    return value

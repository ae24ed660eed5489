# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""STAGE.NAME=VALUE from the command line."""

from collections.abc import Iterable
from typing import Any

from hooc_perception.errors import HoocError
import yaml


def overrides_of(texts: Iterable[str]) -> dict[str, Any]:
    """
    Return {'stage.name': value} of STAGE.NAME=VALUE texts.

    :raises HoocError: where a text does not have that form.
    """
    found: dict[str, Any] = {}
    for text in texts:
        key, equals, value = text.partition('=')
        if not equals or '.' not in key:
            raise HoocError(f'{text!r} does not set a parameter; write STAGE.NAME=VALUE, '
                            'such as parse.deadline_s=2.0')
        try:
            found[key] = yaml.safe_load(value)
        except yaml.YAMLError:
            raise HoocError(f'{text!r}: the value cannot be read; write a plain number or '
                            'word') from None
        if isinstance(found[key], str):
            # YAML 1.1 reads 1e-3 as a string.
            try:
                found[key] = float(value)
            except ValueError:
                pass
    return found

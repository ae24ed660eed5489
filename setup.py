# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What pyproject.toml cannot say so that colcon reads it too; the files of share/."""

from glob import glob
import os
from xml.etree import ElementTree

from setuptools import setup

NAME = 'hooc_perception'
HERE = os.path.dirname(os.path.abspath(__file__))
# package.xml is the only place that states the version and the licence.
MANIFEST = ElementTree.parse(os.path.join(HERE, 'package.xml'))


def tree(folder: str) -> list[tuple[str, list[str]]]:
    """Return data_files rows that install `folder` as it is under share/hooc_perception."""
    return [(os.path.join('share', NAME, root), [os.path.join(root, name) for name in names])
            for root, _, names in os.walk(folder) if names]


setup(
    version=MANIFEST.findtext('version'),
    license=MANIFEST.findtext('license'),
    python_requires='>=3.11',
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/' + NAME]),
        ('share/' + NAME, ['package.xml']),
        ('share/' + NAME + '/config', glob('config/*')),
        ('share/' + NAME + '/launch', glob('launch/*.launch.py')),
        ('share/' + NAME + '/examples', glob('examples/*')),
        *tree('bags'),
        *tree('models'),
    ],
)

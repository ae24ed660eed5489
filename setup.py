# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What pyproject.toml cannot say so that colcon reads it too; the files of share/."""

from glob import glob
import os
import tomllib
from typing import Any
from xml.etree import ElementTree

from setuptools import find_packages, setup

NAME = 'hooc_perception'
HERE = os.path.dirname(os.path.realpath(__file__))
# package.xml is the only place that states the version and the licence.
MANIFEST = ElementTree.parse(os.path.join(HERE, 'package.xml'))


def tree(folder: str) -> list[tuple[str, list[str]]]:
    """Return data_files rows that install `folder` as it is under share/hooc_perception."""
    return [(os.path.join('share', NAME, root), [os.path.join(root, name) for name in names])
            for root, _, names in os.walk(folder) if names]


def declared() -> dict[str, Any]:
    """
    Return what pyproject.toml declares where setuptools does not find that file itself.

    `colcon build --symlink-install` builds in a folder of links to setup.py, setup.cfg, the
    package and the data files.
    """
    if os.path.exists('pyproject.toml'):
        return {}
    with open(os.path.join(HERE, 'pyproject.toml'), 'rb') as file:
        content = tomllib.load(file)
    project, tool = content['project'], content['tool']['setuptools']
    return {
        'name': project['name'],
        'description': project['description'],
        'packages': find_packages(HERE, include=tool['packages']['find']['include']),
        'package_data': tool['package-data'],
        'zip_safe': tool['zip-safe'],
        'install_requires': project['dependencies'],
        'extras_require': project['optional-dependencies'],
        'entry_points': {'console_scripts': [
            f'{name} = {function}' for name, function in project['scripts'].items()]},
    }


setup(
    **declared(),
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

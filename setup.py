# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
from glob import glob
import os
from xml.etree import ElementTree

from setuptools import find_packages, setup

NAME = 'hooc_perception'
HERE = os.path.dirname(os.path.abspath(__file__))
# package.xml is the only place that states the version.
VERSION = ElementTree.parse(os.path.join(HERE, 'package.xml')).findtext('version')
NODES = ('ingestion_node', 'classification_node', 'candidate_node', 'parsing_node',
         'replay_node')


def tree(folder):
    """Return data_files rows that install `folder` as it is under share/hooc_perception."""
    return [(os.path.join('share', NAME, root), [os.path.join(root, name) for name in names])
            for root, _, names in os.walk(folder) if names]


setup(
    name=NAME,
    version=VERSION,
    description='Categories and 6D poses of everything on a table, from depth alone',
    license='Apache-2.0',
    maintainer='The hooc_perception authors',
    maintainer_email='hooc_perception@users.noreply.github.com',
    packages=find_packages(include=[NAME, NAME + '.*']),
    package_data={NAME: ['**/*.j2', '**/*.html', '**/*.css', '**/*.js', '**/*.xml']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/' + NAME]),
        ('share/' + NAME, ['package.xml']),
        ('share/' + NAME + '/config', glob('config/*')),
        ('share/' + NAME + '/launch', glob('launch/*.launch.py')),
        ('share/' + NAME + '/examples', glob('examples/*')),
        *tree('bags'),
        *tree('models'),
    ],
    python_requires='>=3.11',
    install_requires=['setuptools'],
    extras_require={'test': ['pytest'], 'dask': ['distributed'],
                    'rerun': ['rerun-sdk==0.41.0']},
    zip_safe=False,
    entry_points={
        'console_scripts': [
            'hooc = hooc_perception.cli.main:main',
            *(f'{node} = hooc_perception.nodes.{node}:main' for node in NODES),
        ],
    },
)

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""`--executor` of the commands whose work can be spread (hooc_perception/executor.py)."""


def add_argument(parser):
    """Declare the argument."""
    parser.add_argument('--executor', default='local', metavar='WHERE',
                        help='local = the cores at hand (default), dask=ADDRESS = the workers of '
                        'the Dask scheduler there, such as dask=tcp://10.0.0.1:8786; the result '
                        'is the same')

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The environment of the nodes: transport for large images, isolation of parallel runs."""

import os
from pathlib import Path
import random
import shutil
import socket
import sys

from hooc_perception.errors import HoocError
from hooc_perception.ros.lifecycle.spin import PARENT_VARIABLE
from rclpy.exceptions import InvalidNamespaceException
from rclpy.validate_namespace import validate_namespace

FAST_DDS_PROFILE = Path(__file__).with_name('fast_dds.xml')
FAST_DDS_VARIABLES = ('FASTDDS_DEFAULT_PROFILES_FILE', 'FASTRTPS_DEFAULT_PROFILES_FILE')
TRANSPORTS_VARIABLE = 'FASTDDS_BUILTIN_TRANSPORTS'
SHARED_MEMORY = Path('/dev/shm')
SEGMENT_BYTES = 64 * 2 ** 20
# Higher domains use ports that the system may assign to outgoing connections.
DOMAINS = range(1, 102)


def full_namespace(text: str) -> str:
    """
    Return a namespace with its slash, as nodes have it.

    :raises HoocError: if the namespace is not valid in ROS.
    """
    namespace = '/' + text.strip('/')
    try:
        validate_namespace(namespace)
    except InvalidNamespaceException:
        raise HoocError(f'the namespace {text!r} cannot be used: give letters, digits and _, no '
                        'digit first, such as /hooc or /robot1/hooc') from None
    return namespace


def claim_domain() -> tuple[int, socket.socket]:
    """
    Return (domain id, claim) of a ROS domain that no other run on this machine uses.

    The claim is a socket: keep it as long as the domain is in use. The system frees it even if
    this process is killed.

    :raises HoocError: if all of them are taken.
    """
    if sys.platform != 'linux':
        return random.choice(DOMAINS), socket.socket()
    for domain in random.sample(DOMAINS, len(DOMAINS)):
        # An abstract address: it leaves no file behind, and is local to the network namespace.
        claim = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            claim.bind(f'\0hooc_perception.domain.{domain}')
            return domain, claim
        except OSError:
            claim.close()
    raise HoocError(f'all {len(DOMAINS)} ROS domains are in use by runs on this machine; stop '
                    'some, or set ROS_DOMAIN_ID')


def isolate() -> socket.socket | None:
    """
    Separate this process and its children from all other ROS traffic; return the claim.

    Settings of the user (ROS_DOMAIN_ID, ROS_AUTOMATIC_DISCOVERY_RANGE) are respected.
    """
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    if os.environ.get('ROS_DOMAIN_ID'):
        return None
    domain, claim = claim_domain()
    os.environ['ROS_DOMAIN_ID'] = str(domain)
    return claim


def use_large_segments(processes: int = 8) -> bool:
    """
    Make Fast DDS use shared-memory segments that hold several images, if there is room.

    :param processes: how many such segments there will be.
    :return: whether the profile is used. It is not if the user has a profile or has chosen
        transports by FASTDDS_BUILTIN_TRANSPORTS, or if shared memory is too small (containers
        often have 64 MB): writing to a segment without memory behind it kills the process.
    """
    if any(os.environ.get(name) for name in (*FAST_DDS_VARIABLES, TRANSPORTS_VARIABLE)):
        return False
    if not SHARED_MEMORY.is_dir() or (
            shutil.disk_usage(SHARED_MEMORY).free < 1.25 * processes * SEGMENT_BYTES):
        return False
    os.environ.update(dict.fromkeys(FAST_DDS_VARIABLES, str(FAST_DDS_PROFILE)))
    return True


def child_environment() -> dict[str, str]:
    """Return the environment of the process of a node."""
    package_root = str(Path(__file__).resolve().parents[2])
    paths = [package_root, *filter(None, os.environ.get('PYTHONPATH', '').split(os.pathsep))]
    return {**os.environ, 'PYTHONPATH': os.pathsep.join(dict.fromkeys(paths)),
            'PYTHONUNBUFFERED': '1', PARENT_VARIABLE: str(os.getpid()),
            'RCUTILS_COLORIZED_OUTPUT': '0',
            'RCUTILS_CONSOLE_OUTPUT_FORMAT': '[{severity}] {message}'}

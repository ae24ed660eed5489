# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""A ROS context of one's own for each test, on a domain that nobody else uses."""

import pytest


@pytest.fixture
def context():
    """Return an initialised rclpy Context on a private domain."""
    rclpy = pytest.importorskip('rclpy')
    from hooc_perception.supervisor.environment import claim_domain
    domain, claim = claim_domain()
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=domain)
    yield context
    rclpy.try_shutdown(context=context)
    claim.close()

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Results as messages of other packages, on ROS installations that have them.

An adapter imports its message package when it is created, so that nobody needs packages that they
do not use.
"""

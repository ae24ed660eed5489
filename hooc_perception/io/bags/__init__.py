# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Bags of recorded scenes, read and written with rosbags, without a ROS installation."""

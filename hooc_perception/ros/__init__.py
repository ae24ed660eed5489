# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The border to ROS: messages, parameters, QoS, frame sets, diagnostics; no algorithms."""

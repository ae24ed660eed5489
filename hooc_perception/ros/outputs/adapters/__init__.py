# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
The answer in the languages of other packages, on ROS installations that have them.

Each adapter is a class with `publish(scene)` (a DetectedScene) and `clear(stamp_ns, frame)`; its
message package is imported when it is made, so that nobody needs what they do not use.
"""

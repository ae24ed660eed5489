# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The checks of `hooc doctor`: problems of an installation or a bag, each with its fix."""

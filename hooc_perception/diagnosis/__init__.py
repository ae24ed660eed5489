# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The checks of `hooc doctor`: one sentence per problem, with its fix."""

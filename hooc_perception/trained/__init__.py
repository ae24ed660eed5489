# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The MODEL folder that `hooc train` writes and every other command reads."""

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""What is wrong with an installation or a bag, one sentence each, and the mend."""

# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Start the nodes as processes, bring them to active, watch and stop them; run bags."""

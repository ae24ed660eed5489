# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The MODEL folder that `hooc train` writes and every other command reads."""

from hooc_perception.trained.folder import (
    check_place,
    load_model_folder,
    ModelFolder,
    save_model_folder,
)

__all__ = ['ModelFolder', 'check_place', 'load_model_folder', 'save_model_folder']

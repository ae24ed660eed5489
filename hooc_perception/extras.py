# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Optional dependencies: which extra of the package installs a module that is missing."""

# Import name -> extra of pyproject.toml. What is not listed belongs to the plain installation.
EXTRA_OF: dict[str, str] = {
    'rclpy': 'ros',
    **dict.fromkeys(('builtin_interfaces', 'diagnostic_msgs', 'geometry_msgs', 'lifecycle_msgs',
                     'rcl_interfaces', 'sensor_msgs', 'shape_msgs', 'std_msgs', 'std_srvs',
                     'visualization_msgs'), 'ros'),
    'mujoco': 'train',
    'fcl': 'train',
    'open3d': 'train',
    'sklearn': 'eval',
    'psutil': 'eval',
    'pyrender': 'view',
    'rerun': 'view',
    'yourdfpy': 'robot',
    'lxml': 'robot',
    'distributed': 'dask',
    'torch': 'network',
    'onnx': 'network',
}


def install_command(extra: str) -> str:
    """Return the command that installs an extra."""
    return f"pip install 'hooc_perception[{extra}]'"


def advice(error: ImportError) -> str | None:
    """
    Return one sentence on the extra that a failed import needs.

    :return: None where the module belongs to no extra, or is there but broken.
    """
    if not isinstance(error, ModuleNotFoundError) or not error.name:
        return None
    module = error.name.partition('.')[0]
    extra = EXTRA_OF.get(module)
    if extra is None:
        return None
    return f'{module} is not installed; run: {install_command(extra)}'

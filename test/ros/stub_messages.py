# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
Message packages that are not installed, made from their definitions.

The classes behave as those that ROS generates: named arguments only, no attributes but the
fields, nested defaults. `cdr` writes a message by its definition, type by type, and so finds
what a real publisher would refuse.
"""

import sys
import types

import numpy as np
from rosbags.typesys import get_types_from_msg, get_typestore, Stores

# From vision_msgs 4.1, moveit_msgs 2.6, object_recognition_msgs 2.0, octomap_msgs 2.0 and
# tf2_msgs 0.36 (ROS 2 Jazzy), without comments.
DEFINITIONS = {
    'tf2_msgs/msg/TFMessage': 'geometry_msgs/TransformStamped[] transforms',
    'vision_msgs/msg/ObjectHypothesis': 'string class_id\nfloat64 score',
    'vision_msgs/msg/ObjectHypothesisWithPose':
        'vision_msgs/ObjectHypothesis hypothesis\ngeometry_msgs/PoseWithCovariance pose',
    'vision_msgs/msg/BoundingBox3D': 'geometry_msgs/Pose center\ngeometry_msgs/Vector3 size',
    'vision_msgs/msg/Detection3D': """std_msgs/Header header
        vision_msgs/ObjectHypothesisWithPose[] results
        vision_msgs/BoundingBox3D bbox
        string id""",
    'vision_msgs/msg/Detection3DArray':
        'std_msgs/Header header\nvision_msgs/Detection3D[] detections',
    'object_recognition_msgs/msg/ObjectType': 'string key\nstring db',
    'octomap_msgs/msg/Octomap':
        'std_msgs/Header header\nbool binary\nstring id\nfloat64 resolution\nint8[] data',
    'octomap_msgs/msg/OctomapWithPose': """std_msgs/Header header
        geometry_msgs/Pose origin
        octomap_msgs/Octomap octomap""",
    'moveit_msgs/msg/CollisionObject': """std_msgs/Header header
        geometry_msgs/Pose pose
        string id
        object_recognition_msgs/ObjectType type
        shape_msgs/SolidPrimitive[] primitives
        geometry_msgs/Pose[] primitive_poses
        shape_msgs/Mesh[] meshes
        geometry_msgs/Pose[] mesh_poses
        shape_msgs/Plane[] planes
        geometry_msgs/Pose[] plane_poses
        string[] subframe_names
        geometry_msgs/Pose[] subframe_poses
        byte ADD=0
        byte REMOVE=1
        byte APPEND=2
        byte MOVE=3
        byte operation""",
    'moveit_msgs/msg/AttachedCollisionObject': """string link_name
        moveit_msgs/CollisionObject object
        string[] touch_links
        trajectory_msgs/JointTrajectory detach_posture
        float64 weight""",
    'moveit_msgs/msg/RobotState': """sensor_msgs/JointState joint_state
        sensor_msgs/MultiDOFJointState multi_dof_joint_state
        moveit_msgs/AttachedCollisionObject[] attached_collision_objects
        bool is_diff""",
    'moveit_msgs/msg/AllowedCollisionEntry': 'bool[] enabled',
    'moveit_msgs/msg/AllowedCollisionMatrix': """string[] entry_names
        moveit_msgs/AllowedCollisionEntry[] entry_values
        string[] default_entry_names
        bool[] default_entry_values""",
    'moveit_msgs/msg/LinkPadding': 'string link_name\nfloat64 padding',
    'moveit_msgs/msg/LinkScale': 'string link_name\nfloat64 scale',
    'moveit_msgs/msg/ObjectColor': 'string id\nstd_msgs/ColorRGBA color',
    'moveit_msgs/msg/PlanningSceneWorld': """moveit_msgs/CollisionObject[] collision_objects
        octomap_msgs/OctomapWithPose octomap""",
    'moveit_msgs/msg/PlanningScene': """string name
        moveit_msgs/RobotState robot_state
        string robot_model_name
        geometry_msgs/TransformStamped[] fixed_frame_transforms
        moveit_msgs/AllowedCollisionMatrix allowed_collision_matrix
        moveit_msgs/LinkPadding[] link_padding
        moveit_msgs/LinkScale[] link_scale
        moveit_msgs/ObjectColor[] object_colors
        moveit_msgs/PlanningSceneWorld world
        bool is_diff""",
}
_DEFAULTS = {'string': '', 'bool': False, 'byte': b'\x00', 'float64': 0.0}
_STORE = get_typestore(Stores.ROS2_JAZZY)
for _name, _text in DEFINITIONS.items():
    _STORE.register({k: v for k, v in get_types_from_msg(_text, _name).items()
                     if k not in _STORE.types})


def install(monkeypatch, package):
    """Have `import <package>.msg` find classes of the definitions; return that module."""
    module = types.ModuleType(f'{package}.msg')
    monkeypatch.setitem(sys.modules, package, types.ModuleType(package))
    monkeypatch.setitem(sys.modules, module.__name__, module)
    for name, text in DEFINITIONS.items():
        if name.startswith(f'{package}/'):
            setattr(module, name.rpartition('/')[2], make(name))
    return module


def make(name):
    """Return the class of a definition, such as vision_msgs/msg/Detection3D."""
    fields, constants = {}, {}
    for line in DEFINITIONS[name].split('\n'):
        kind, field = line.split()
        if '=' in field:
            field, value = field.split('=')
            constants[field] = bytes([int(value)])
        else:
            fields[field] = kind

    def __init__(self, **values):
        for field, kind in fields.items():
            setattr(self, field, values.pop(field) if field in values else _default(kind))
        assert not values, f'{name} has no {sorted(values)}'

    return type(name.rpartition('/')[2], (), {
        '__slots__': tuple(fields), '__init__': __init__, 'definition': name, **constants})


def _default(kind):
    """Return the value that a field of this type has in a new message."""
    if kind.endswith('[]'):
        return []
    if kind in _DEFAULTS:
        return _DEFAULTS[kind]
    package, _, name = kind.partition('/')
    full = f'{package}/msg/{name}'
    if full in DEFINITIONS:
        return make(full)()
    return getattr(__import__(f'{package}.msg', fromlist=['msg']), name)()


def cdr(message):
    """Return the bytes of a stub message on the wire, and the message read back from them."""
    data = _STORE.serialize_cdr(_typed(message, message.definition), message.definition)
    return bytes(data), _STORE.deserialize_cdr(data, message.definition)


def _typed(message, name):
    """Return a message as the dataclass of its definition."""
    kind = _STORE.types[name]
    return kind(**{field: _value(getattr(message, field), *description)
                   for field, description in _STORE.fielddefs[name][1]})


def _value(value, node, description):
    if node.name == 'NAME':
        return _typed(value, description)
    if node.name == 'BASE':
        kind = description[0]
        wanted = {'string': str, 'bool': bool, 'byte': bytes, 'octet': bytes}.get(
            kind, float if kind.startswith('float') else int)
        assert isinstance(value, wanted), f'{value!r} is no {kind}'
        return value[0] if kind in ('byte', 'octet') else value
    (inner_node, inner), _ = description
    if inner_node.name == 'BASE' and inner[0] != 'string':
        return np.asarray(value, inner[0])
    return [_value(item, inner_node, inner) for item in value]

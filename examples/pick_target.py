# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""Wait for an object of a category and print a pre-grasp pose above it as JSON."""

import argparse
import json
import sys
from typing import Any

import numpy as np
import rclpy
from rclpy.qos import DurabilityPolicy, QoSProfile
from scipy.spatial.transform import Rotation
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import String

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
FORMATS = {2: 'u1', 4: 'u2', 6: 'u4', 7: 'f4'}      # of sensor_msgs/PointField


def best_row(cloud: PointCloud2, labels: String, args: argparse.Namespace, now_s: float) -> Any:
    """Return the row of objects/attributes with the name and the best score, or None."""
    rows = np.frombuffer(cloud.data, np.dtype({
        'names': [f.name for f in cloud.fields], 'itemsize': cloud.point_step,
        'formats': [FORMATS[f.datatype] for f in cloud.fields],
        'offsets': [f.offset for f in cloud.fields]}))
    names = {int(c): known['name'] for c, known in json.loads(labels.data)['classes'].items()}
    age_s = now_s - cloud.header.stamp.sec - 1e-9 * cloud.header.stamp.nanosec
    mine = [row for row in rows if names[int(row['category'])] == args.name
            and row['score'] >= args.score and age_s < args.max_age]
    return max(mine, key=lambda row: row['score'], default=None)


def pre_grasp(row: Any, clearance: float) -> tuple[list[float], list[float]]:
    """Return (position, quaternion) above an object: tool z down, tool x across its thin side."""
    R = Rotation.from_quat([row[q] for q in ('qx', 'qy', 'qz', 'qw')]).as_matrix()
    sides = (R * 0.5 * np.array([row[s] for s in ('size_x', 'size_y', 'size_z')])).T
    top = row['z'] + np.abs(sides[:, 2]).sum()
    lying = np.delete(sides, np.argmax(np.abs(R[2])), axis=0)[:, :2]    # the horizontal sides
    thin = lying[np.argmin(np.linalg.norm(lying, axis=1))]
    x, z = np.append(thin / np.linalg.norm(thin), 0), np.array([0, 0, -1])
    tool = Rotation.from_matrix(np.column_stack([x, np.cross(z, x), z]))
    return [float(row['x']), float(row['y']), float(top + clearance)], tool.as_quat().tolist()


def main() -> int | str:
    """Run the node; return the exit code or an error message."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('name', help='category, such as teacup')
    for option, default in (('score', 0.5), ('clearance', 0.1), ('max-age', 10), ('timeout', 60)):
        parser.add_argument(f'--{option}', type=float, default=default)
    args = parser.parse_args()
    received: dict[str, Any] = {}
    rclpy.init()
    node = rclpy.create_node('pick_target', namespace='/hooc')
    for topic, kind in (('objects/labels', String), ('objects/attributes', PointCloud2)):
        node.create_subscription(kind, topic, lambda m, t=topic: received.update({t: m}), LATCHED)
    now = start = node.get_clock().now().nanoseconds * 1e-9
    row = None
    while row is None and now - start < args.timeout:
        rclpy.spin_once(node, timeout_sec=0.1)
        now = node.get_clock().now().nanoseconds * 1e-9
        if len(received) == 2:
            row = best_row(received['objects/attributes'], received['objects/labels'], args, now)
    if row is not None:
        position, orientation = pre_grasp(row, args.clearance)
        print(json.dumps({'id': int(row['id']), 'score': float(row['score']),
                          'frame': received['objects/attributes'].header.frame_id,
                          'position': position, 'orientation_xyzw': orientation}))
    rclpy.try_shutdown()
    return 0 if row is not None else f'no {args.name} was found within {args.timeout:g} s'


if __name__ == '__main__':
    sys.exit(main())

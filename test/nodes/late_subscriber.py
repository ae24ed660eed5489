# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""
What a user writes who knows nothing but rclpy, the standard messages and the topics' names.

Prints one line of JSON an object: name, position, size, score; then `done`.
"""

import json
import struct
import sys
import time

from geometry_msgs.msg import PoseArray
import rclpy
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import String

FORMATS = {2: 'B', 4: 'H', 6: 'I', 7: 'f'}


def main():
    rclpy.init()
    node = rclpy.create_node('late_subscriber')
    latched = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE,
                         durability=DurabilityPolicy.TRANSIENT_LOCAL)
    got = {}
    for topic, kind in (('poses', PoseArray), ('attributes', PointCloud2), ('labels', String)):
        node.create_subscription(kind, f'/hooc/objects/{topic}',
                                 lambda message, topic=topic: got.update({topic: message}),
                                 latched)
    deadline = time.monotonic() + 20
    while len(got) < 3 and time.monotonic() < deadline:
        rclpy.spin_once(node, timeout_sec=0.1)
    if len(got) < 3:
        sys.exit(f'only {sorted(got)} came')
    cloud, classes = got['attributes'], json.loads(got['labels'].data)['classes']
    for i, pose in enumerate(got['poses'].poses):
        row = {field.name: struct.unpack_from('<' + FORMATS[field.datatype], bytes(cloud.data),
                                              i * cloud.point_step + field.offset)[0]
               for field in cloud.fields}
        print(json.dumps({
            'name': classes[str(row['category'])]['name'], 'score': row['score'],
            'translation': [pose.position.x, pose.position.y, pose.position.z],
            'size': [row['size_x'], row['size_y'], row['size_z']]}))
    print('done', got['poses'].header.frame_id)
    node.destroy_node()
    rclpy.shutdown()


if __name__ == '__main__':
    main()

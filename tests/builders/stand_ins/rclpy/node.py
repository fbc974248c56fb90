"""Stand-in for rclpy.node."""

from __future__ import annotations

import sys
from itertools import pairwise


class Publisher:
    def __init__(self, msg_type, topic):
        self.msg_type, self.topic = msg_type, topic

    def publish(self, message):
        assert type(message) is self.msg_type
        points = [pose.position for pose in message.poses]
        length = sum(((a.x - b.x) ** 2 + (a.y - b.y) ** 2 + (a.z - b.z) ** 2) ** 0.5 for a, b in pairwise(points))
        print(f"ROS: {len(points)} joints, {length:.3f} m in {message.header.frame_id} on {self.topic}")


class Logger:
    def warning(self, message):
        print(message, file=sys.stderr)


class Node:
    def __init__(self, node_name):
        self.node_name = node_name

    def create_publisher(self, msg_type, topic, qos_profile):
        return Publisher(msg_type, topic)

    def get_logger(self):
        return Logger()

    def destroy_node(self):
        del self.node_name

"""Stand-in for rclpy: `spin` delivers the frames of a sample to the node, and then returns as after Ctrl-C."""

from __future__ import annotations

import message_filters

_is_running = False


def init(args=None):
    global _is_running
    _is_running = True


def spin(node):
    assert _is_running, "rclpy.init() comes first"
    message_filters.deliver()


def shutdown():
    global _is_running
    assert _is_running
    _is_running = False

"""Stand-in for geometry_msgs.msg; as in ROS, fields take their own type only."""

from __future__ import annotations

from dataclasses import dataclass, field

from sensor_msgs.msg import Header


@dataclass(kw_only=True)
class Point:
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0

    def __post_init__(self):
        assert all(type(value) is float for value in (self.x, self.y, self.z)), "The field must be of type 'float'"


@dataclass(kw_only=True)
class Pose:
    position: Point = field(default_factory=Point)


@dataclass(kw_only=True)
class PoseArray:
    header: Header = field(default_factory=Header)
    poses: list[Pose] = field(default_factory=list)

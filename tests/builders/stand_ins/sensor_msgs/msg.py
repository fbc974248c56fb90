"""Stand-in for sensor_msgs.msg, and the messages that are parts of them."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(kw_only=True)
class Time:
    sec: int = 0
    nanosec: int = 0


@dataclass(kw_only=True)
class Header:
    stamp: Time = field(default_factory=Time)
    frame_id: str = ""


@dataclass(kw_only=True)
class Image:
    header: Header = field(default_factory=Header)
    height: int = 0
    width: int = 0
    encoding: str = ""
    is_bigendian: int = 0
    step: int = 0
    data: bytes = b""


@dataclass(kw_only=True)
class CameraInfo:
    header: Header = field(default_factory=Header)
    height: int = 0
    width: int = 0
    distortion_model: str = ""
    d: list[float] = field(default_factory=list)
    k: list[float] = field(default_factory=lambda: [0.0] * 9)

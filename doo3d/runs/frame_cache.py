"""Frame data kept between a frame's two jobs, detecting and rendering, in the process that read it."""

from __future__ import annotations

import secrets
from collections import OrderedDict

from ..types import Cloud, Frame, Image

MAX_FRAMES = 8
"""Frames kept in one process at most (a frame of 1280x720 takes 6 MB); older ones are read again from disk."""


class FrameCache:
    """The most recently read frames of one process, each until it is taken or `max_frames` newer ones are added.

    Each executor owns the caches of its processes and passes the cache to every job as the first argument; the cache itself
    never travels between processes.
    """

    def __init__(self, max_frames: int = MAX_FRAMES) -> None:
        self._max_frames = max_frames
        self._frames: OrderedDict[str, Frame | Cloud | Image] = OrderedDict()

    def __len__(self) -> int:
        return len(self._frames)

    def add(self, data: Frame | Cloud | Image) -> str:
        """Keep a frame's data and return its key, unique among all processes; drop the oldest beyond `max_frames`."""
        key = secrets.token_hex(8)
        self._frames[key] = data
        while len(self._frames) > self._max_frames:
            self._frames.popitem(last=False)
        return key

    def take(self, key: str) -> Frame | Cloud | Image | None:
        """Remove and return the data of a key; None if this cache does not hold it."""
        return self._frames.pop(key, None)

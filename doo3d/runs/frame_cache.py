"""Frame data kept between a frame's two jobs, detecting and rendering, in the process that read it."""

from __future__ import annotations

import secrets
from collections import OrderedDict

from ..types import Cloud, Frame, Image

MAX_FRAMES = 8
"""Frames kept in one process at most (a frame of 1280x720 takes 6 MB); older ones are read again from disk."""


class FrameCache:
    """The data of the frames that one process read last, kept in memory between the two jobs of a frame.

    The detecting job adds a frame's data and the rendering job takes it, so that a frame is read from disk once. A frame is
    dropped once `max_frames` newer ones were added. The executor has one cache per process and passes it to every job as the
    first argument; the cache is never sent to another process.

    Parameters
    ----------
    max_frames
        largest number of frames to keep.
    """

    def __init__(self, max_frames: int = MAX_FRAMES) -> None:
        self._max_frames = max_frames
        self._frames: OrderedDict[str, Frame | Cloud | Image] = OrderedDict()

    def __len__(self) -> int:
        return len(self._frames)

    def add(self, data: Frame | Cloud | Image) -> str:
        """Keep a frame's data and return its key, a text unique among all processes.

        If the cache then holds more than `max_frames` frames, the oldest is dropped.
        """
        key = secrets.token_hex(8)
        self._frames[key] = data
        while len(self._frames) > self._max_frames:
            self._frames.popitem(last=False)
        return key

    def take(self, key: str) -> Frame | Cloud | Image | None:
        """Remove a frame's data from the cache and return it; None if no frame with this key is in the cache."""
        return self._frames.pop(key, None)

"""Keep the data of a frame in memory between its two jobs, detecting and rendering, in the process that read it."""

import secrets
from collections import OrderedDict

import numpy as np

from ..types import Cloud, Frame, Image

MAX_BYTES = 256_000_000
"""Greatest size in bytes of the frame data kept in one process: 40 frames of 1280x720 px. Older frames are read from disk
again."""


class FrameCache:
    """The data of the frames that one process read last, kept in memory between the two jobs of a frame.

    The detecting job adds a frame's data and the rendering job takes it, so that a frame is read from disk once. A frame is
    dropped once newer ones have filled `max_bytes`. The executor has one cache per process and passes it to every job as the
    first argument; the cache is never sent to another process.

    Parameters
    ----------
    max_bytes
        largest size of all frames together; the newest frame is kept whatever its size.
    """

    def __init__(self, max_bytes: int = MAX_BYTES) -> None:
        self._max_bytes = max_bytes
        self._bytes = 0
        self._frames: OrderedDict[str, Frame | Cloud | Image] = OrderedDict()

    def __len__(self) -> int:
        return len(self._frames)

    def add(self, data: Frame | Cloud | Image) -> str:
        """Keep a frame's data and return its key, a text unique among all processes.

        While the cache then holds more than `max_bytes`, the oldest frame is dropped.
        """
        key = secrets.token_hex(8)
        self._frames[key] = data
        self._bytes += _size(data)
        while self._bytes > self._max_bytes and len(self._frames) > 1:
            self.take(next(iter(self._frames)))
        return key

    def take(self, key: str) -> Frame | Cloud | Image | None:
        """Remove a frame's data from the cache and return it; None if no frame with this key is in the cache."""
        data = self._frames.pop(key, None)
        if data is not None:
            self._bytes -= _size(data)
        return data


def _size(data: Frame | Cloud | Image) -> int:
    """Return the number of bytes of the arrays of a frame."""
    return sum(value.nbytes for value in vars(data).values() if isinstance(value, np.ndarray))

"""One frame: the walk through the stages."""

from __future__ import annotations

from .config import Config
from .types import Array, Cloud, Detection, Frame


def detect(data: Frame | Cloud | Array, config: Config | None = None, mask: Array | None = None) -> Detection:
    """To be filled in."""
    raise NotImplementedError

"""A capture whose frames are fused to one cloud (`doo3d detect --fuse-views`)."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path

from ..config import Config
from ..errors import InputError
from ..inputs import Capture, FrameData, FrameRef
from .fusion import FUSED_NAME, fuse


class FusedCapture:
    """A capture of a single frame, named "static": the point cloud made by fusing all frames of another capture.

    It has the attributes of a capture (`path`, `format`, `masks`, `selection`, `frames`). The other capture is read and fused
    when the single frame is loaded: `frames[0].load()`.

    Parameters
    ----------
    capture
        the frames to fuse, with camera poses and an object at rest.
    config
        configuration of segmentation and fusion.

    Raises
    ------
    InputError : the config is for images (mode "2d").
    """

    def __init__(self, capture: Capture, config: Config) -> None:
        if config.mode == "2d":
            raise InputError(
                "--fuse-views fuses frames in space, and the config is for images (mode: 2d): use a 3-D one (-c default)",
                code="config-mode",
            )
        self.path, self.format = capture.path, f"{capture.format}, fused"
        self.masks: Path | None = getattr(capture, "masks", None)
        self.selection: str | None = getattr(capture, "selection", None)
        loader = partial(_load_fused, tuple(capture.frames), config)
        self.frames: Sequence[FrameRef] = [FrameRef(FUSED_NAME, capture.path, loader)]


def _load_fused(frames: tuple[FrameRef, ...], config: Config) -> FrameData:
    return FrameData(fuse(frames, config))

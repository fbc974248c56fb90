"""Make a capture whose frames are fused to one cloud (`--fuse-views`)."""

from functools import partial

from ..config import Config
from ..errors import InputError
from ..inputs import Capture, FrameData, FrameRef
from .fuse import FUSED_NAME, fuse


def fused_capture(capture: Capture, config: Config) -> Capture:
    """Return a capture of a single frame: the cloud fused from another capture.

    The other capture is read and fused when the frame, named "static", is loaded: `frames[0].load()`.

    Parameters
    ----------
    capture
        the frames to fuse, with camera poses and an object at rest.
    config
        the settings of segmentation and fusion.

    Raises
    ------
    InputError : the config is for images (mode "2d").
    """
    if config.mode == "2d":
        raise InputError(
            "--fuse-views fuses frames in space, and the config is for images (mode: 2d): use a 3-D one (-c default)",
            code="config-mode",
        )
    frame = FrameRef(FUSED_NAME, capture.path, partial(_load_fused, tuple(capture.frames), config))
    return Capture(capture.path, f"{capture.format}, fused", [frame], masks=capture.masks, selection=capture.selection)


def _load_fused(frames: tuple[FrameRef, ...], config: Config) -> FrameData:
    """Return the data of the fused frame."""
    return FrameData(fuse(frames, config))

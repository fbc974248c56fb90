"""What every format gives: a capture of entries, each of which loads one shot."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Protocol

from ..config import Config
from ..types import Bools, Cloud, Floats, Frame, Image
from .read_options import DEFAULT, ReadOptions


@dataclass(frozen=True)
class FrameData:
    """One moment of a capture.

    data : Frame or Cloud; Image for the 2-D mode.
    mask : (H, W) bool, the pixels of the object as the capture knows them; None where it does not.
    pose : (4, 4) the camera's optical frame in the world, x_world = pose @ x_camera; None where it is not known.
    """

    data: Frame | Cloud | Image
    mask: Bools | None = None
    pose: Floats | None = None

    def mask_for(self, config: Config) -> Bools | None:
        """Return the capture's own mask (H, W) bool, or None if the config names another method of segmentation."""
        return self.mask if config.segment.method in ("auto", "mask") else None


@dataclass(frozen=True)
class FrameRef:
    """A place in a capture, cheap to hold; its data is read by `load` and not kept.

    name : what the results of this frame are called, unique in its capture.
    source : the file that it comes from. timestamp : s; None where the capture has none.
    loader : reads the shot; raises InputError with the file's name when it cannot. It can be pickled, for other processes.
    """

    name: str
    source: Path
    loader: Callable[[], FrameData]
    timestamp: float | None = None

    def load(self) -> FrameData:
        """Read the shot from disk.

        Raises
        ------
        InputError : it cannot be read, or is not what the format says.
        """
        return self.loader()


class Capture(Protocol):
    """Frames in the order they were taken.

    format : the format's name in the registry. path : as the user gave it. frames : the entries, not yet loaded.
    A capture may have `parts` too, a list of str: its topics or streams, a line each, for `doo3d info`.
    """

    format: str
    path: Path
    frames: Sequence[FrameRef]


class CaptureFormat(Protocol):
    """The class of a format: asked whether a path is its own, then called with it and with what the user says about it.

    what : the format in half a sentence, for the error that lists what can be read.
    """

    what: ClassVar[str]

    def can_read(self, path: Path) -> bool: ...

    def __call__(self, path: Path, options: ReadOptions = DEFAULT) -> Capture: ...

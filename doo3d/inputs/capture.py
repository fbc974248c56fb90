"""The interface of every format: a capture is a sequence of frame references, each of which loads one frame's data."""

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
    """The data of one frame of a capture.

    data : Frame or Cloud; Image for the 2-D mode.
    mask : (H, W) bool, the pixels of the object as annotated in the capture; None if it has no mask.
    pose : (4, 4) the camera's optical frame in the world, x_world = pose @ x_camera, m; None if unknown.
    """

    data: Frame | Cloud | Image
    mask: Bools | None = None
    pose: Floats | None = None

    def mask_for(self, config: Config) -> Bools | None:
        """Return the capture's own mask (H, W) bool, or None if the config names another method of segmentation."""
        return self.mask if config.segment.method in ("auto", "mask") else None


@dataclass(frozen=True)
class FrameRef:
    """A reference to one frame of a capture: small, picklable; `load` reads the data and does not keep it.

    name : the frame's name in results, unique in its capture.
    source : the file or folder that the frame is read from. timestamp : s; None if the capture has no times.
    loader : reads the data; raises InputError with the file's name. It can be pickled, for other processes.
    """

    name: str
    source: Path
    loader: Callable[[], FrameData]
    timestamp: float | None = None

    def load(self) -> FrameData:
        """Read the frame's data from disk.

        Raises
        ------
        InputError : a file cannot be read, or its content does not follow the format.
        """
        return self.loader()


class Capture(Protocol):
    """A sequence of frames in recording order.

    format : the format's name in the registry. path : as given by the user. frames : references, not yet loaded.
    A capture may also have `topics`, a list of str: a line for each topic or stream, printed by `doo3d info`.
    """

    format: str
    path: Path
    frames: Sequence[FrameRef]


class CaptureFormat(Protocol):
    """The class of a format: `can_read` tests a path; calling the class with the path and the options opens the capture.

    what : the format in half a sentence, for the error that lists the formats.
    """

    what: ClassVar[str]

    def can_read(self, path: Path) -> bool: ...

    def __call__(self, path: Path, options: ReadOptions = DEFAULT) -> Capture: ...

"""The interface of every format: a capture is a sequence of frame references, each of which loads one frame's data."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar, Protocol

from ..config import Config
from ..guard.guarding import guarded
from ..guard.limits import Limits, current_limits, limited
from ..types import Bools, Cloud, Floats, Frame, Image
from .read_options import DEFAULT, ReadOptions


@dataclass(frozen=True)
class FrameData:
    """The data of one frame of a capture.

    Attributes
    ----------
    data
        Frame (depth with or without color) or Cloud; Image (color alone) for the 2-D mode.
    mask
        (H, W) bool, true on the object, from the capture or from mask files that the user gave; None if there is no mask.
    pose
        (4, 4) float, camera to world: x_world = pose @ x_camera, in metres; None if unknown. The camera frame is the optical
        frame: x right, y down, z forward. For a cloud it is the frame of the cloud's points.
    base_pose
        (4, 4) float, camera to the frame that results are wanted in, such as a robot's base frame, in metres; None: results are
        in the camera's own frame.
    """

    data: Frame | Cloud | Image
    mask: Bools | None = None
    pose: Floats | None = None
    base_pose: Floats | None = None

    def mask_for(self, config: Config) -> Bools | None:
        """Return `mask` if the config lets it segment the object (`segment.method` is "auto" or "mask"), else None.

        None as well if the frame has no mask.
        """
        return self.mask if config.segment.method in ("auto", "mask") else None


@dataclass(frozen=True)
class FrameRef:
    """A reference to one frame of a capture: small, picklable, without the data.

    Attributes
    ----------
    name
        the frame's name in results, unique in its capture.
    source
        the file or folder that the frame is read from.
    loader
        function without arguments that reads the data. It raises InputError with the file's name, and can be pickled.
    timestamp
        time of the frame, s; None if the capture has no times.
    limits
        the largest data that is read; by default those of `open_capture`, which makes the reference.
    """

    name: str
    source: Path
    loader: Callable[[], FrameData]
    timestamp: float | None = None
    limits: Limits = field(default_factory=current_limits, compare=False)

    def load(self) -> FrameData:
        """Read the frame from disk and return its FrameData (`data`, `mask`, `pose`). Nothing is cached.

        Raises
        ------
        InputError : a file cannot be read, or its content does not follow the format, or announces more than the limits allow.
        """
        with guarded(self.source), limited(self.limits):
            return self.loader()


class Capture(Protocol):
    """The interface of an opened recording: a sequence of frames in recording order.

    A capture may also have `topics`, a list of str: a line for each topic or stream, printed by `doo3d info`; and `notes`, a list
    of str: a sentence for each thing that was assumed or mended in reading it, printed by `doo3d info` and `doo3d detect`;
    and `extra_files`, a list of Path: files outside of `path` that were read, such as a camera file, whose change is noticed.

    Attributes
    ----------
    format
        name of the format, a key of `doo3d.inputs.FORMATS`.
    path
        the file or folder, as given by the user.
    frames
        references to the frames; their data is read by `FrameRef.load`.
    """

    format: str
    path: Path
    frames: Sequence[FrameRef]


def extra_files_of(capture: Capture) -> list[Path]:
    """Return the files outside of its path that a capture was read from; empty if it has none."""
    return list(getattr(capture, "extra_files", ()))


def notes_of(capture: Capture) -> list[str]:
    """Return the notes of a capture, or of the whole capture of a selection; empty if it has none."""
    return list(getattr(getattr(capture, "whole", capture), "notes", ()))


class CaptureFormat(Protocol):
    """The interface of a class that reads one capture format; calling it with a path and options returns an opened Capture.

    A class may also have `options`, a frozenset of the names of the ReadOptions that it honors: others are then refused. Without
    it no option is refused.

    Attributes
    ----------
    what
        short description of the format, such as "a recording of the app Record3D (.r3d)", for the error that lists the formats.
    """

    what: ClassVar[str]

    def can_read(self, path: Path) -> bool:
        """Return whether `path` (an existing file or folder) is in this format, judged quickly from its content."""

    def __call__(self, path: Path, options: ReadOptions = DEFAULT) -> Capture:
        """Open the capture at `path`; raise InputError if something that all frames need is missing or damaged."""

"""Define the capture: a sequence of frame references, each of which loads one frame's data."""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar, Protocol, overload

from ..config import Config
from ..errors import ArgumentError, InputError, UnknownFrame
from ..guard.guarding import guarded
from ..guard.limits import Limits, current_limits, limited
from ..types import Bools, Cloud, Floats, Frame, Image
from ..types.arrays import fit_mask
from .read_options import DEFAULT, ReadOptions

_SHOWN_NAMES = 5  # of frames, in errors
_OF_READERS = ("path", "format", "frames", "notes", "topics", "extra_files", "no_depth")  # attributes that readers fill


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
        (4, 4) float, from the camera to the coordinate frame of the results, such as a robot's base frame, in metres; None for
        results in the camera's own frame.
    notes
        sentences for the user about how the frame was read.
    """

    data: Frame | Cloud | Image
    mask: Bools | None = None
    pose: Floats | None = None
    base_pose: Floats | None = None
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Crop or pad a mask whose size differs from the image's by a pixel, with a note."""
        if self.mask is not None and not isinstance(self.data, Cloud):
            image = self.data.depth if isinstance(self.data, Frame) else self.data.color
            mask, note = fit_mask(self.mask, image.shape[:2])
            if note:
                object.__setattr__(self, "mask", mask)
                object.__setattr__(self, "notes", (*self.notes, note))

    def mask_for(self, config: Config) -> Bools | None:
        """Return `mask` if the config segments by masks (`segment.method` is "auto" or "mask"); otherwise None.

        The result is also None if the frame has no mask.
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


@dataclass(repr=False, eq=False)
class Capture(Sequence[FrameRef]):
    """A capture is a sequence of its frames: `len`, iteration, and indexing by number, slice or name.

    `capture[3]` and `capture["000003"]` are the FrameRef of one frame, whose data `load()` reads; `capture[-1]` is the last.
    `capture[10:20]` is a capture of these frames.

    Attributes
    ----------
    path
        the file or folder, as given by the user.
    format
        name of the format, a key of `doo3d.inputs.FORMATS`.
    frames
        references to the frames; their data is read by `FrameRef.load`.
    notes
        a sentence for each assumption and repair made while reading, printed by `doo3d info` and `doo3d detect`.
    topics
        a line for each topic or stream of a bag, printed by `doo3d info`.
    extra_files
        files outside of `path` that were read, such as a camera file; a resumed run checks whether they have changed.
    no_depth
        reason why depth that the capture seems to contain is not read; empty if frames have depth or there is none.
    options
        the options that the capture was read with.
    masks
        path of the mask files that the user gave; None if there are none.
    base_pose
        the pose of the camera in a robot's base frame as nested lists, or the option ("capture", "tf:base_link"); None if none is
        given.
    selection
        the selection of frames as on the command line, such as "--start 2s --every 5"; None if `frames` are all frames.
    indices
        numbers of the frames in the whole capture, from 0, increasing; None if `frames` are all frames.
    whole
        the capture with all frames; None if this capture has all frames.
    """

    path: Path
    format: str
    frames: Sequence[FrameRef]
    notes: Sequence[str] = ()
    topics: Sequence[str] = ()
    extra_files: Sequence[Path] = ()
    no_depth: str = ""
    options: ReadOptions = DEFAULT
    masks: Path | None = None
    base_pose: Any = None
    selection: str | None = None
    indices: Sequence[int] | None = None
    whole: Capture | None = None

    @staticmethod
    def of(read: Any) -> Capture:
        """Convert the object that a reader returned to a Capture; it has `path`, `format`, `frames` and optional attributes."""
        if isinstance(read, Capture):
            return read
        return Capture(**{name: getattr(read, name) for name in _OF_READERS if hasattr(read, name)})

    def selected(self, indices: Sequence[int], selection: str) -> Capture:
        """Return a capture with only the frames of the given numbers; `selection` : the same choice on the command line."""
        numbers = list(indices) if self.indices is None else [self.indices[i] for i in indices]
        frames = [self.frames[i] for i in indices]
        return replace(self, frames=frames, selection=selection, indices=numbers, whole=self.whole or self)

    def __len__(self) -> int:
        return len(self.frames)

    def __iter__(self) -> Iterator[FrameRef]:
        return iter(self.frames)

    def __contains__(self, frame: object) -> bool:
        """Return whether a frame, or a frame of this name, is in the capture."""
        return isinstance(frame, FrameRef | str) and any(frame in (each, each.name) for each in self.frames)

    @overload
    def __getitem__(self, key: int | str) -> FrameRef: ...
    @overload
    def __getitem__(self, key: slice) -> Capture: ...
    def __getitem__(self, key: int | str | slice) -> FrameRef | Capture:
        """Return the frame with a number or a name, or a capture of the frames of a slice.

        Raises
        ------
        UnknownFrame (an IndexError) : the capture has no such frame.
        ArgumentError (a TypeError) : the key is neither a whole number, a text nor a slice of whole numbers.
        InputError : the step of a slice is not positive.
        """
        try:
            if isinstance(key, slice):
                return self._slice(key)
            if isinstance(key, str):
                return next(reference for reference in self.frames if reference.name == key)
            return self.frames[range(len(self))[operator.index(key)]]
        except (StopIteration, IndexError):
            names = ", ".join([each.name for each in self.frames[:_SHOWN_NAMES]] + ["..."] * (len(self) > _SHOWN_NAMES))
            has = f"it has {len(self)}, from 0: {names}" if names else "it has none"
            raise UnknownFrame(f"{self.path}: has no frame {key!r}; {has}", code="frame-unknown") from None
        except TypeError:
            given = f"a capture was given a {type(key).__name__} for a frame"
            sentence = f"{given}, expected its number, its name or a slice of numbers"
            raise ArgumentError(sentence, code="argument-type") from None

    def _slice(self, part: slice) -> Capture:
        if part.step is not None and operator.index(part.step) < 1:
            sentence = f"a slice of a capture with the step {part.step}: frames keep their order, so give 1 or more"
            raise InputError(sentence, code="selection-invalid")
        chosen = range(*part.indices(len(self)))
        if len(chosen) == len(self):
            return self
        if not chosen:
            return self.selected((), "no frames")
        if self.indices is not None:
            return self.selected(chosen, f"--frames {','.join(str(self.indices[i]) for i in chosen)}")
        every = f" --every {chosen.step}" if chosen.step > 1 else ""
        return self.selected(chosen, f"--start {chosen[0]} --end {chosen[-1]}{every}")

    def __repr__(self) -> str:
        return f"Capture({str(self.path)!r}, {self.format}, {len(self)} frame{'s' * (len(self) != 1)})"


class CaptureFormat(Protocol):
    """The interface of a class that reads one capture format; calling it with a path and options opens a capture.

    The returned object has `path`, `format` and `frames` of a Capture, and may have `notes`, `topics`, `extra_files` and
    `no_depth`. A class may also have `options`, a frozenset of the names of the ReadOptions that it supports: others are then
    refused. Without it, no option is refused.

    Attributes
    ----------
    what
        short description of the format, such as "a recording of the app Record3D (.r3d)", for the error that lists the formats.
    """

    what: ClassVar[str]

    def can_read(self, path: Path) -> bool:
        """Return whether `path` (an existing file or folder) is in this format, judged quickly from its content."""

    def __call__(self, path: Path, options: ReadOptions = DEFAULT) -> Any:
        """Open the capture at `path`; raise InputError if something that all frames need is missing or damaged."""

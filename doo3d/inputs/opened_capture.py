"""What `open_capture` returns for every format: a capture as a sequence of its frames."""

from __future__ import annotations

import operator
from collections.abc import Iterator, Sequence
from typing import Any, overload

from ..errors import ArgumentError, UnknownFrame
from .capture import Capture, FrameRef
from .frame_selection import select_slice
from .read_options import DEFAULT, ReadOptions

_SHOWN_NAMES = 5  # of frames, in errors


class OpenedCapture(Sequence[FrameRef]):
    """A capture that is a sequence of its frames: `len`, iteration, and indexing by number, slice or name.

    `capture[3]` and `capture["000003"]` are the FrameRef of one frame, whose data `load()` reads; `capture[-1]` is the last.
    `capture[10:20]` is a capture of these frames. Everything else, such as `notes`, is as of the format's own capture.

    Attributes
    ----------
    format
        name of the format, a key of `doo3d.inputs.FORMATS`.
    path
        the file or folder, as given by the user.
    frames
        references to the frames; their data is read by `FrameRef.load`.
    options
        the options that the capture was read with.
    """

    def __init__(self, capture: Capture, options: ReadOptions = DEFAULT) -> None:
        self._capture = capture
        self.path, self.format, self.frames, self.options = capture.path, capture.format, capture.frames, options

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):  # such as those that copying looks for, before there is a capture
            raise AttributeError(name)
        return getattr(self._capture, name)

    def __len__(self) -> int:
        return len(self.frames)

    def __iter__(self) -> Iterator[FrameRef]:
        return iter(self.frames)

    def __contains__(self, frame: object) -> bool:
        """Return whether a frame, or a frame of this name, is in the capture."""
        if isinstance(frame, str):
            return any(reference.name == frame for reference in self.frames)
        return isinstance(frame, FrameRef) and frame in self.frames

    @overload
    def __getitem__(self, key: int | str) -> FrameRef: ...
    @overload
    def __getitem__(self, key: slice) -> OpenedCapture: ...
    def __getitem__(self, key: int | str | slice) -> FrameRef | OpenedCapture:
        """Return the frame of a number or a name, or a capture of the frames of a slice.

        Raises
        ------
        UnknownFrame (an IndexError) : the capture has no such frame.
        ArgumentError (a TypeError) : the key is neither a whole number, a text nor a slice of whole numbers.
        InputError : the step of a slice is not positive.
        """
        try:
            if isinstance(key, slice):
                return OpenedCapture(select_slice(self._capture, key), self.options)
            if isinstance(key, str):
                return next(reference for reference in self.frames if reference.name == key)
            return self.frames[range(len(self))[operator.index(key)]]
        except (StopIteration, IndexError):
            raise UnknownFrame(f"{self.path}: has no frame {key!r}; {self._described()}", code="frame-unknown") from None
        except TypeError:
            raise ArgumentError(
                f"a capture was given a {type(key).__name__} for a frame, expected its number, its name or a slice of numbers",
                code="argument-type",
            ) from None

    def _described(self) -> str:
        names = [reference.name for reference in self.frames[:_SHOWN_NAMES]]
        more = ", ..." if len(self) > _SHOWN_NAMES else ""
        return f"it has {len(self)}, from 0: {', '.join(names)}{more}" if names else "it has none"

    def __repr__(self) -> str:
        return f"Capture({str(self.path)!r}, {self.format}, {len(self)} frame{'s' * (len(self) != 1)})"

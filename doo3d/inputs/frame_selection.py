"""Select frames of a capture: by number, by time, or every Nth."""

import re
from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..types import Bools, Floats
from .capture import Capture

_POSITION = re.compile(r"(-?)(\d+(?:\.\d+)?|\.\d+)(s?)")
_TOKEN = r"-?(?:\d+\.?\d*|\.\d+)s?"
_SPAN = re.compile(rf"({_TOKEN})(?:-({_TOKEN}))?")
_TIME_EPS_S = 1e-6  # two times closer than this are equal; float64 resolves times since 1970 to 2e-7 s


@dataclass(frozen=True)
class Selection:
    """Conditions that choose frames of a capture; a frame is used if it meets all of them.

    A position is written as a frame number (`0` the first frame, `-1` the last) or as a time since the first frame (`12.5s`;
    `-2s` is 2 s before the last frame).

    Attributes
    ----------
    every
        step between used frames: of those that meet the other conditions, numbers 0, every, 2 * every, ... are used.
    start, end
        positions of the first and of the last frame to use, both included; None for no limit.
    frames
        positions and spans of positions to use, such as `3,7,10-20` or `2s-4.5s`, both ends of a span included; None for all
        frames.

    Raises
    ------
    InputError : `every` is below 1. Malformed positions are found when the selection is applied to a capture.
    """

    every: int = 1
    start: str | None = None
    end: str | None = None
    frames: str | None = None

    def __post_init__(self) -> None:
        if self.every < 1:
            raise InputError(f"--every {self.every}: expected 1 or more", code="selection-invalid")

    def __str__(self) -> str:
        """Return the options as on the command line; empty if every frame is selected."""
        given = [("--frames", self.frames), ("--start", self.start), ("--end", self.end)]
        options = [f"{option} {''.join(str(value).split())}" for option, value in given if value is not None]
        return " ".join([*options, *([f"--every {self.every}"] if self.every > 1 else [])])


def select_frames(capture: Capture, selection: Selection) -> Capture:
    """Return a capture with only the selected frames, or `capture` itself if `selection` has only its defaults.

    Raises
    ------
    InputError : a position is malformed or not in the capture, a time is given but frames have none, or no frame is left.
    """
    if not str(selection):
        return capture
    index = _FrameIndex(capture)
    selected = np.ones(index.count, dtype=bool) if selection.frames is None else index.listed(selection.frames)
    selected &= index.span(selection.start, None, "--start")
    selected &= index.span(None, selection.end, "--end")
    indices = np.flatnonzero(selected)[:: selection.every].tolist()
    if not indices:
        raise InputError(f"{capture.path}: {selection} selects no frame; {index.describe()}", code="selection-empty")
    return capture.selected(indices, str(selection))


class _FrameIndex:
    """The numbers (0 to count - 1) and times (s since the first) of a capture's frames."""

    def __init__(self, capture: Capture) -> None:
        self.path, self.count = capture.path, len(capture.frames)
        stamps = np.array([np.nan if frame.timestamp is None else frame.timestamp for frame in capture.frames], dtype=float)
        self._has_times = self.count > 0 and bool(np.isfinite(stamps).all())
        self._seconds = stamps - stamps.min() if self._has_times else stamps

    def describe(self) -> str:
        """Return the range of frame numbers and times for an error message, such as "it has the frames 0 to 99, 0s to 3.3s"."""
        time = f", 0s to {self._seconds.max():.6g}s" if self._has_times else ""
        return f"it has the frames 0 to {self.count - 1}{time}" if self.count else "it has no frames at all"

    def span(self, first: str | None, last: str | None, option: str) -> Bools:
        """Return (count,) bool, true for each frame from `first` to `last`, both included; None leaves that end open.

        `option` is the command-line option that the positions were given with, named in errors.
        """
        inside = np.ones(self.count, dtype=bool)
        for position, sign in ((first, 1), (last, -1)):
            if position is not None:
                positions, value = self._on_axis(position, option)
                inside &= sign * (positions - value) >= -_TIME_EPS_S
        return inside

    def listed(self, text: str) -> Bools:
        """Return (count,) bool, true for each frame of a list such as `3,7,10-20`.

        A single time, such as `2.5s`, selects the frame nearest to it.

        Raises
        ------
        InputError : the list is malformed, a single position is outside the capture, or frames have no times.
        """
        selected = np.zeros(self.count, dtype=bool)
        for part in text.split(","):
            match = _SPAN.fullmatch(part.strip())
            if match is None:
                sentence = f"expected numbers and spans such as 3,7,10-20 or 2s-4.5s, got {part.strip()!r}"
                raise InputError(f"--frames {text}: {sentence}", code="selection-invalid")
            if match[2]:
                selected |= self.span(match[1], match[2], "--frames")
            else:
                selected[self._nearest(match[1])] = True
        return selected

    def _nearest(self, position: str) -> int:
        positions, value = self._on_axis(position, "--frames")
        if not self.count or not -_TIME_EPS_S <= value <= positions.max() + _TIME_EPS_S:
            raise InputError(f"{self.path}: there is no frame {position} (--frames); {self.describe()}", code="frame-unknown")
        return int(np.argmin(np.abs(positions - value)))

    def _on_axis(self, position: str, option: str) -> tuple[Floats, float]:
        """Return the values of all frames (count,) and the value of a position: numbers, or s since the first frame.

        A position is written as `12` or `-1` (frame number, -1 the last frame), or `12.5s` or `-2s` (time). `option` is the
        command-line option that it was given to, for errors.
        """
        match = _POSITION.fullmatch(position.strip())
        if match is None or ("." in match[2] and not match[3]):
            sentence = "expected a frame's number, 0 the first and -1 the last, or a time such as 12.5s"
            raise InputError(f"{option} {position}: {sentence}", code="selection-invalid")
        value, in_seconds = float(match[2]), bool(match[3])
        if in_seconds and not self._has_times:
            sentence = f"{option} {position} is a time, but not all frames have one: give a frame's number"
            raise InputError(f"{self.path}: {sentence}", code="times-missing")
        values = self._seconds if in_seconds else np.arange(self.count, dtype=float)
        return values, values.max(initial=0.0) - value + (not in_seconds) if match[1] else value

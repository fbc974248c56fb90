"""Some of a capture's frames: by their place, by time, or every so many of them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..types import Bools, Floats
from .capture import Capture, FrameRef

_MARK = re.compile(r"(-?)(\d+(?:\.\d+)?|\.\d+)(s?)")
_TOKEN = r"-?(?:\d+\.?\d*|\.\d+)s?"
_SPAN = re.compile(rf"({_TOKEN})(?:-({_TOKEN}))?")
_SAME = 1e-6  # s; float64 tells times since 1970 apart by 2e-7


@dataclass(frozen=True)
class Mark:
    """A place in a capture: a frame by its number from 0, or s since the first frame; `last`: counted back from the end."""

    value: float
    timed: bool
    last: bool

    def __str__(self) -> str:
        return f"{'-' if self.last else ''}{self.value:g}{'s' if self.timed else ''}"

    @staticmethod
    def of(text: str, option: str) -> Mark:
        """From `12`, `-1`, `12.5s` or `-2s`.

        Raises
        ------
        InputError : it is none of these.
        """
        found = _MARK.fullmatch(text.strip())
        if found is None or ("." in found[2] and not found[3]):
            raise InputError(
                f"{option} {text}: expected a frame's number, 0 the first and -1 the last, or a time such as 12.5s",
                code="selection-invalid",
            )
        return Mark(float(found[2]), bool(found[3]), found[1] == "-")


@dataclass(frozen=True)
class Selection:
    """What is asked for; all of it has to hold. Frames are numbered from 0, in the order of the capture.

    every : of what is left by the others, the first and then every so many. start, end : the first and the last frame.
    frames : places and spans of them, such as `3,7,10-20`; both ends of a span are in it.
    """

    every: int = 1
    start: str | None = None
    end: str | None = None
    frames: str | None = None

    def __post_init__(self) -> None:
        if self.every < 1:
            raise InputError(f"--every {self.every}: expected 1 or more", code="selection-invalid")

    def __str__(self) -> str:
        """As on the command line; empty when everything is selected."""
        parts = [("--frames", self.frames), ("--start", self.start), ("--end", self.end)]
        said = [f"{option} {''.join(str(value).split())}" for option, value in parts if value is not None]
        return " ".join([*said, *([f"--every {self.every}"] if self.every > 1 else [])])


class SelectedCapture:
    """A capture with some of its frames only, in their order.

    selection : as on the command line. whole : the capture. indices : the numbers of the frames that are left.

    Raises
    ------
    InputError : a place that cannot be or is not there, a time where frames have none, or nothing is left.
    """

    def __init__(self, capture: Capture, selection: Selection) -> None:
        self.path, self.format, self.whole = capture.path, capture.format, capture
        self.masks: Path | None = getattr(capture, "masks", None)
        self.selection = str(selection)
        places = _Places(capture)
        chosen = np.ones(places.count, dtype=bool)
        if selection.frames is not None:
            chosen &= places.listed(selection.frames)
        if selection.start is not None:
            chosen &= places.span(Mark.of(selection.start, "--start"), None, "--start")
        if selection.end is not None:
            chosen &= places.span(None, Mark.of(selection.end, "--end"), "--end")
        self.indices = np.flatnonzero(chosen)[:: selection.every].tolist()
        if not self.indices:
            raise InputError(f"{capture.path}: {self.selection} leaves no frame; {places.there()}", code="selection-empty")
        self.frames: Sequence[FrameRef] = [capture.frames[i] for i in self.indices]


def selected(capture: Capture, selection: Selection) -> Capture:
    """The capture itself where everything is selected, else a `SelectedCapture`."""
    return SelectedCapture(capture, selection) if str(selection) else capture


class _Places:
    """The places that a capture has: frames 0 to count - 1, and their times since the first."""

    def __init__(self, capture: Capture) -> None:
        self.path, self.count = capture.path, len(capture.frames)
        stamps = np.array([np.nan if entry.timestamp is None else entry.timestamp for entry in capture.frames], dtype=float)
        self._timed = self.count > 0 and bool(np.isfinite(stamps).all())
        self._seconds = stamps - stamps.min() if self._timed else stamps

    def there(self) -> str:
        """What can be chosen, in words."""
        time = f", 0s to {self._seconds.max():.6g}s" if self._timed else ""
        return f"it has the frames 0 to {self.count - 1}{time}" if self.count else "it has no frames at all"

    def span(self, first: Mark | None, last: Mark | None, option: str) -> Bools:
        """(count,) bool: the frames from a mark to a mark, both included."""
        inside = np.ones(self.count, dtype=bool)
        if first is not None:
            at, value = self._along(first, option)
            inside &= at >= value - _SAME
        if last is not None:
            at, value = self._along(last, option)
            inside &= at <= value + _SAME
        return inside

    def listed(self, text: str) -> Bools:
        """(count,) bool: the frames of a list such as `3,7,10-20`; of a single time, the frame nearest to it."""
        chosen = np.zeros(self.count, dtype=bool)
        for part in text.split(","):
            found = _SPAN.fullmatch(part.strip())
            if found is None:
                raise InputError(
                    f"--frames {text}: expected numbers and spans such as 3,7,10-20 or 2s-4.5s, got {part.strip()!r}",
                    code="selection-invalid",
                )
            first, last = (Mark.of(token, "--frames") if token else None for token in found.groups())
            if first is not None and last is None:
                chosen[self._nearest(first)] = True
            else:
                chosen |= self.span(first, last, "--frames")
        return chosen

    def _nearest(self, mark: Mark) -> int:
        at, value = self._along(mark, "--frames")
        if not self.count or not -_SAME <= value <= at.max() + _SAME:
            raise InputError(f"{self.path}: there is no frame {mark} (--frames); {self.there()}", code="frame-unknown")
        return int(np.argmin(np.abs(at - value)))

    def _along(self, mark: Mark, option: str) -> tuple[Floats, float]:
        """(count,) where the frames are and where the mark is: numbers, or s since the first frame."""
        if mark.timed and not self._timed:
            raise InputError(
                f"{self.path}: not all frames have a time, so {option} {mark} says nothing: give a frame's number",
                code="times-missing",
            )
        at = self._seconds if mark.timed else np.arange(self.count, dtype=float)
        return at, at.max(initial=0.0) - mark.value + (not mark.timed) if mark.last else mark.value

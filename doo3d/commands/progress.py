"""Print the progress of a command: a line per frame on stdout, and a bar on stderr if that is a terminal."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

import typer

from .messages import wrapped
from .progress_bars import has_bar, progress_display, uninterrupted

if TYPE_CHECKING:
    from rich.progress import Progress

    from ..runs.frame_record import FrameRecord


class Reporter:
    """Printer of a run's progress: call it with the FrameRecord of each finished frame to print a line for the frame.

    With a progress bar, the line is printed above the bar, and the bar advances by one frame.

    Parameters
    ----------
    total
        number of frames.
    column
        number of characters to which the names of the frames are padded.
    quiet
        whether to print errors only.
    bar
        the progress bar; None if there is none.
    time_limit
        s that a frame may take; None if unknown.

    Attributes
    ----------
    total, finished
        number of all frames, and of frames whose files are written.
    """

    def __init__(self, total: int, column: int, quiet: bool, bar: Bar | None, time_limit: float | None = None) -> None:
        self.total, self.column, self.quiet = total, column, quiet
        self.finished = 0
        self._topics: set[str] = set()
        self._bar, self._time_limit = bar, time_limit
        self._echo = bar.print_above if bar else typer.echo

    def note(self, sentence: str) -> None:
        """Print a remark about the run on stderr."""
        if not self.quiet:
            with uninterrupted():
                self._echo(wrapped(f"note: {sentence}", sys.stderr), err=True)

    def resumed(self, records: Sequence[FrameRecord]) -> None:
        """Print on stderr the number of frames that an earlier run finished, and count them as done in the progress bar.

        `records` are the records of these frames.
        """
        self.finished = len(records)
        rest = "nothing is left to do (--restart starts over)" if len(records) == self.total else "resuming after them"
        frames = "1 frame is" if len(records) == 1 else f"{len(records)} frames are"
        with uninterrupted():
            if not self.quiet:
                self._echo(f"{frames} finished already, {rest}", err=True)
            if self._bar:
                self._bar.start(records)

    def __call__(self, record: FrameRecord) -> None:
        """Print the line of a frame."""
        with uninterrupted():
            self.finished = min(self.finished + 1, self.total)
            self._print(record)
            if self._bar:
                self._bar.advance(record)

    def _print(self, record: FrameRecord) -> None:
        from .messages import failure_line, frame_line

        if record.error is not None:
            error = record.error + self._remedy(record.code) + (f" [{record.code}]" if record.code else "")
            line = failure_line(record.name, error, self.column) if self.total > 1 else f"doo3d: {error}"
            self._echo(wrapped(line, sys.stderr), err=True)
        elif not self.quiet:
            values = (record.lengths, record.radii, record.confidences, record.occluded, record.units, record.seconds)
            trees = None if record.objects is None else (record.objects, record.junctions or 0)
            line = frame_line(record.name, *values, self.column, trees, record.doubtful)
            label = f"{'':<{self.column}}   note: "
            notes = (wrapped(label + note, sys.stdout, len(label)) for note in self._unsaid(record.notes))
            self._echo("\n".join([line, *notes]))

    def _remedy(self, code: str | None) -> str:
        """Return the options that help against an error of a frame, as text; empty if there are none."""
        if code != "time-limit" or self._time_limit is None:
            return ""
        return f"; to wait longer, add: --retry-failed --time-limit {10 * self._time_limit:g}"

    def _unsaid(self, notes: Sequence[str]) -> list[str]:
        """Return the notes of a frame, without those whose topic was already printed for an earlier frame."""
        from ..types.plausibility import topic_of

        topics = {note: topic for note in notes if (topic := topic_of(note)) is not None}
        unsaid = [note for note in notes if topics.get(note) not in self._topics]
        self._topics |= set(topics.values())
        return unsaid


@contextmanager
def reporting(
    total: int, column: int, quiet: bool, label: str = "", lines: bool = True, time_limit: float | None = None
) -> Iterator[Reporter]:
    """Yield the Reporter of a run for the duration of a `with` block.

    The Reporter has a progress bar if stderr is a terminal, there are two frames or more, and `quiet` is false.

    Parameters
    ----------
    total
        number of frames.
    column
        number of characters to which the names of the frames are padded.
    quiet
        whether to print errors only.
    label
        name of the work, printed once with the number of frames.
    lines
        whether to print a line for each frame.
    time_limit
        s that a frame may take; None if unknown.
    """
    if label and not quiet:
        typer.echo(f"{label} of {total} frames", err=True)
    silent = quiet or not lines
    if quiet or not has_bar(total):
        yield Reporter(total, column, silent, None, time_limit)
        return
    texts = ("{task.fields[rate]}", "{task.fields[chains]} chains, {task.fields[failed]} failed")
    with progress_display(*texts) as progress:
        yield Reporter(total, column, silent, Bar(progress, total), time_limit)


class Bar:
    """A progress bar with the mean rate of the run, time left, and the numbers of chains and of failed frames.

    `advance`, called with the record of each frame that is done, redraws it.

    Parameters
    ----------
    progress
        the display of the package rich that shows the bar.
    total
        number of frames.
    """

    def __init__(self, progress: Progress, total: int) -> None:
        self._progress = progress
        with uninterrupted():
            self._task = progress.add_task("", total=total, chains=0, failed=0, rate="")
            progress.refresh()
        self._chains = self._failed = self._done = 0
        self._began = time.monotonic()

    def start(self, records: Sequence[FrameRecord]) -> None:
        """Start the bar of a resumed run; `records` are the records of the frames that an earlier run finished.

        These frames count as done, but not in the rate, which is that of this run only.
        """
        self._count(records)
        # rich drops the fields that a reset does not name
        self._progress.reset(self._task, completed=len(records), chains=self._chains, failed=self._failed, rate="")

    def print_above(self, text: str, err: bool = False) -> None:
        """Print a text above the bar: on stderr if `err` is true, else on stdout."""
        if err or sys.stdout.isatty():
            self._progress.console.print(text, markup=False, highlight=False, emoji=False, soft_wrap=True)
        else:
            typer.echo(text)

    def advance(self, record: FrameRecord) -> None:
        """Count one more finished frame, with the chains or the failure that its record states, and redraw the bar."""
        self._count([record])
        self._done += 1
        rate = rate_text(self._done, time.monotonic() - self._began)
        self._progress.update(self._task, advance=1, refresh=True, rate=rate, chains=self._chains, failed=self._failed)

    def _count(self, records: Sequence[FrameRecord]) -> None:
        self._chains += sum(len(record.lengths) for record in records)
        self._failed += sum(record.error is not None for record in records)


_MIN_RATE_FRAMES = 3
"""Least number of frames for a rate: the first frame includes loading, and several workers finish their first frames together."""


def rate_text(frames: int, seconds: float) -> str:
    """Return the mean rate of a run, such as "2.5 frames/s" or "12.0 s/frame"; empty for fewer than three frames.

    frames : number of finished frames. seconds : their total time, s.
    """
    if frames < _MIN_RATE_FRAMES or seconds <= 0:
        return ""
    return f"{frames / seconds:.1f} frames/s" if frames >= seconds else f"{seconds / frames:.1f} s/frame"

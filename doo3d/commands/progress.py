"""Progress of a command: a line per frame on stdout, and a bar on stderr if that is a terminal."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Protocol

import typer

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

    Attributes
    ----------
    total, finished
        number of frames, and of those whose files are written.
    """

    def __init__(self, total: int, column: int, quiet: bool, bar: Bar | None) -> None:
        self.total, self.column, self.quiet = total, column, quiet
        self.finished = 0
        self._topics: set[str] = set()
        self._bar = bar

    def note(self, sentence: str) -> None:
        """Print a remark about the run on stderr."""
        if not self.quiet:
            typer.echo(f"note: {sentence}", err=True)

    def resumed(self, records: Sequence[FrameRecord]) -> None:
        """Print on stderr how many frames an earlier run has finished, and count these frames as done in the progress bar.

        `records` are the records of these frames.
        """
        self.finished = len(records)
        if not self.quiet:
            rest = "nothing is left to do (--restart starts over)" if len(records) == self.total else "resuming after them"
            frames = "1 frame is" if len(records) == 1 else f"{len(records)} frames are"
            typer.echo(f"{frames} finished already, {rest}", err=True)
        if self._bar:
            self._bar.start(records)

    def __call__(self, record: FrameRecord) -> None:
        """Print the line of a frame."""
        from .messages import failure_line, frame_line

        self.finished = min(self.finished + 1, self.total)
        echo = self._bar.print_above if self._bar else typer.echo
        if record.error is not None:
            error = record.error + (f" [{record.code}]" if record.code else "")
            echo(failure_line(record.name, error, self.column) if self.total > 1 else f"doo3d: {error}", err=True)
        elif not self.quiet:
            values = (record.lengths, record.radii, record.occluded, record.units, record.seconds)
            trees = None if record.objects is None else (record.objects, record.junctions or 0)
            line = frame_line(record.name, *values, self.column, trees)
            echo("\n".join([line, *(f"{'':<{self.column}}   note: {note}" for note in self._unsaid(record.notes))]))
        if self._bar:
            self._bar.advance(record)

    def _unsaid(self, notes: Sequence[str]) -> list[str]:
        """Return the notes of a frame without those of a check that has given one for an earlier frame."""
        from ..plausibility import topic_of

        topics = {note: topic for note in notes if (topic := topic_of(note)) is not None}
        unsaid = [note for note in notes if topics.get(note) not in self._topics]
        self._topics |= set(topics.values())
        return unsaid


@contextmanager
def reporting(total: int, column: int, quiet: bool, label: str = "", lines: bool = True) -> Iterator[Reporter]:
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
        what is done, to stand before the bar.
    lines
        whether to print a line for each frame; if not, the label is printed once.
    """
    if label and not quiet and not (lines and sys.stderr.isatty()):
        typer.echo(f"{label} of {total} frames", err=True)
    silent = quiet or not lines
    if quiet or total < 2 or not sys.stderr.isatty():
        yield Reporter(total, column, silent, None)
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    tail = TextColumn("{task.fields[chains]} chains, {task.fields[failed]} failed")
    columns = (
        TextColumn(label),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]}"),
        TimeRemainingColumn(),
        tail,
    )
    console = Console(stderr=True)
    with Progress(*columns, console=console, auto_refresh=False, transient=True, redirect_stdout=False) as progress:
        yield Reporter(total, column, silent, Bar(progress, total))


class Bar:
    """A progress bar with frames per second, time left, and the numbers of chains and of failed frames.

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
        self._task = progress.add_task("", total=total, chains=0, failed=0, rate="")
        self._chains = self._failed = 0

    def start(self, records: Sequence[FrameRecord]) -> None:
        """Start the bar of a resumed run; `records` are the records of the frames that an earlier run finished.

        These frames count as done, but not in the frames per second, which are those of this run alone.
        """
        self._count(records)
        self._progress.reset(self._task, completed=len(records), chains=self._chains, failed=self._failed)

    def print_above(self, text: str, err: bool = False) -> None:
        """Print a text above the bar: on stderr if `err` is true, else on stdout."""
        if err or sys.stdout.isatty():
            self._progress.console.print(text, markup=False, highlight=False, soft_wrap=True)
        else:
            typer.echo(text)

    def advance(self, record: FrameRecord) -> None:
        """Count one more finished frame, with the chains or the failure that its record states, and redraw the bar."""
        self._count([record])
        speed = self._progress.tasks[self._task].speed
        rate = f"{speed:.1f} frames/s" if speed else ""
        self._progress.update(self._task, advance=1, refresh=True, rate=rate, chains=self._chains, failed=self._failed)

    def _count(self, records: Sequence[FrameRecord]) -> None:
        self._chains += sum(len(record.lengths) for record in records)
        self._failed += sum(record.error is not None for record in records)


class FrameResult(Protocol):
    """What a score says of a frame."""

    @property
    def correct(self) -> bool:
        """Whether the frame is correct."""


class Scored(Protocol):
    """The result of one frame of an evaluation."""

    @property
    def name(self) -> str:
        """Name of the frame."""

    @property
    def score(self) -> FrameResult:
        """Its score."""


@contextmanager
def counting(total: int) -> Iterator[Callable[[Scored], None]]:
    """Yield a function that advances a progress bar by one frame of an evaluation, for the duration of a `with` block.

    Call the function with the result of each finished frame. The bar is on stderr and shows the number of correct frames
    so far. `total` is the number of frames. Without a terminal, or if `total` is below 2, the function does nothing.
    """
    if total < 2 or not sys.stderr.isatty():
        yield lambda result: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (BarColumn(), MofNCompleteColumn(), TimeRemainingColumn(), TextColumn("{task.fields[status]}"))
    with Progress(*columns, console=Console(stderr=True), auto_refresh=False, transient=True, redirect_stdout=False) as progress:
        task, correct = progress.add_task("", total=total, status=""), 0

        def advance(result: Scored) -> None:
            nonlocal correct
            correct += result.score.correct
            progress.update(task, advance=1, refresh=True, status=f"{correct} correct   {result.name}")

        yield advance

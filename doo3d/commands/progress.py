"""Progress of a command: a line per frame on stdout, and a bar on stderr if that is a terminal."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from rich.progress import Progress

    from ..evaluation.benchmark.rows import Row
    from ..runs.frame_record import FrameRecord


def say_compiling() -> None:
    """Print a notice on stderr if this run is going to compile the kernels."""
    from ..kernels import are_compiled

    if not are_compiled():
        typer.echo("the first run compiles for some seconds ...", err=True)


class Reporter:
    """Prints a line per frame, above a bar if there is one.

    Parameters
    ----------
    total
        number of frames.
    column
        width of the names.
    quiet
        print errors only.
    bar
        the bar; None without a terminal.
    """

    def __init__(self, total: int, column: int, quiet: bool, bar: Bar | None) -> None:
        self.total, self.column, self.quiet = total, column, quiet
        self._bar = bar

    def resumed(self, records: Sequence[FrameRecord]) -> None:
        """Print how many frames an earlier run has finished."""
        if not self.quiet:
            rest = "nothing is left to do (--restart starts over)" if len(records) == self.total else "resuming after them"
            frames = "1 frame is" if len(records) == 1 else f"{len(records)} frames are"
            typer.echo(f"{frames} finished already, {rest}", err=True)
        if self._bar:
            self._bar.start(records)

    def __call__(self, record: FrameRecord) -> None:
        """Print the line of a frame."""
        from .messages import failure_line, frame_line

        echo = self._bar.print_above if self._bar else typer.echo
        if record.error is not None:
            error = record.error + (f" [{record.code}]" if record.code else "")
            echo(failure_line(record.name, error, self.column) if self.total > 1 else f"doo3d: {error}", err=True)
        elif not self.quiet:
            values = (record.lengths, record.radii, record.occluded, record.units, record.seconds)
            line = frame_line(record.name, *values, self.column)
            echo("\n".join([line, *(f"{'':<{self.column}}   note: {note}" for note in record.notes)]))
        if self._bar:
            self._bar.advance(record)


@contextmanager
def reporting(total: int, column: int, quiet: bool) -> Iterator[Reporter]:
    """Provide a Reporter for the duration of a run, with a bar if stderr is a terminal and there is more than one frame.

    Parameters
    ----------
    total, column, quiet
        as of Reporter.
    """
    if quiet or total < 2 or not sys.stderr.isatty():
        yield Reporter(total, column, quiet, None)
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    tail = TextColumn("{task.fields[chains]} chains, {task.fields[failed]} failed")
    columns = (BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[rate]}"), TimeRemainingColumn(), tail)
    console = Console(stderr=True)
    with Progress(*columns, console=console, auto_refresh=False, transient=True, redirect_stdout=False) as progress:
        yield Reporter(total, column, quiet, Bar(progress, total))


class Bar:
    """A progress bar on stderr, redrawn after each frame only: frames per second, time left, chains and failures."""

    def __init__(self, progress: Progress, total: int) -> None:
        self._progress = progress
        self._task = progress.add_task("", total=total, chains=0, failed=0, rate="")
        self._chains = self._failed = 0

    def start(self, records: Sequence[FrameRecord]) -> None:
        """Start after the frames of an earlier run; the rate is that of this run alone."""
        self._count(records)
        self._progress.reset(self._task, completed=len(records), chains=self._chains, failed=self._failed)

    def print_above(self, text: str, err: bool = False) -> None:
        """Print above the bar, on stdout or (`err`) on stderr."""
        if err or sys.stdout.isatty():
            self._progress.console.print(text, markup=False, highlight=False, soft_wrap=True)
        else:
            typer.echo(text)

    def advance(self, record: FrameRecord) -> None:
        """Advance by one frame."""
        self._count([record])
        speed = self._progress.tasks[self._task].speed
        rate = f"{speed:.1f} frames/s" if speed else ""
        self._progress.update(self._task, advance=1, refresh=True, rate=rate, chains=self._chains, failed=self._failed)

    def _count(self, records: Sequence[FrameRecord]) -> None:
        self._chains += sum(len(record.lengths) for record in records)
        self._failed += sum(record.error is not None for record in records)


@contextmanager
def counting(total: int) -> Iterator[Callable[[Row], None]]:
    """Provide a function to call with each finished row of an evaluation; it draws a bar if stderr is a terminal."""
    if total < 2 or not sys.stderr.isatty():
        yield lambda row: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (BarColumn(), MofNCompleteColumn(), TimeRemainingColumn(), TextColumn("{task.fields[status]}"))
    with Progress(*columns, console=Console(stderr=True), auto_refresh=False, transient=True, redirect_stdout=False) as progress:
        task, correct = progress.add_task("", total=total, status=""), 0

        def advance(row: Row) -> None:
            nonlocal correct
            correct += row.score.correct
            progress.update(task, advance=1, refresh=True, status=f"{correct} correct   {row.name}")

        yield advance

"""What is said while a command runs."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from ..batch import FrameRecord
    from ..evaluation.rows import Row


def say_compiling() -> None:
    """Say so when the first run is going to compile."""
    from ..kernels import compiled

    if not compiled():
        typer.echo("the first run compiles for some seconds ...", err=True)


@contextmanager
def reporting(total: int, column: int, quiet: bool) -> Iterator[Callable[[FrameRecord], None]]:
    """What prints a line per frame, with a bar below where there is a terminal and more than one frame."""
    from ..outputs.lines import failure_line, frame_line

    def show(record: FrameRecord, say: Callable[..., None]) -> None:
        if record.error is not None:
            say(failure_line(record.name, record.error, column) if total > 1 else f"doo3d: {record.error}", err=True)
        elif not quiet:
            line = frame_line(record.name, record.lengths, record.radii, record.occluded, record.units, record.seconds, column)
            say("\n".join([line, *(f"{'':<{column}}   note: {note}" for note in record.notes)]))

    if quiet or total < 2 or not sys.stderr.isatty():
        yield lambda record: show(record, typer.echo)
        return
    with _bar(total) as (above, step):

        def advance(record: FrameRecord) -> None:
            show(record, above)
            step(record)

        yield advance


@contextmanager
def _bar(total: int) -> Iterator[tuple[Callable[..., None], Callable[[FrameRecord], None]]]:
    """A progress bar on stderr, drawn between frames only; with it, what prints above it and what moves it on."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    tail = TextColumn("{task.fields[chains]} chains, {task.fields[failed]} failed")
    columns = (BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[rate]}"), TimeRemainingColumn(), tail)
    console = Console(stderr=True)
    with Progress(*columns, console=console, auto_refresh=False, transient=True, redirect_stdout=False) as progress:
        task = progress.add_task("", total=total, chains=0, failed=0, rate="")
        chains, failed = 0, 0

        def above(text: str, err: bool = False) -> None:
            if err or sys.stdout.isatty():
                console.print(text, markup=False, highlight=False, soft_wrap=True)
            else:
                typer.echo(text)

        def step(record: FrameRecord) -> None:
            nonlocal chains, failed
            chains, failed = chains + len(record.lengths), failed + (record.error is not None)
            speed = progress.tasks[task].speed
            rate = f"{speed:.1f} frames/s" if speed else ""
            progress.update(task, advance=1, refresh=True, rate=rate, chains=chains, failed=failed)

        yield above, step


@contextmanager
def counting(total: int) -> Iterator[Callable[[Row], None]]:
    """What takes a row of an evaluation when it is done: a bar on stderr where that is a terminal, nothing elsewhere."""
    if total < 2 or not sys.stderr.isatty():
        yield lambda row: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (BarColumn(), MofNCompleteColumn(), TimeRemainingColumn(), TextColumn("{task.fields[said]}"))
    with Progress(*columns, console=Console(stderr=True), auto_refresh=False, transient=True, redirect_stdout=False) as progress:
        task, correct = progress.add_task("", total=total, said=""), 0

        def step(row: Row) -> None:
            nonlocal correct
            correct += row.score.correct
            progress.update(task, advance=1, refresh=True, said=f"{correct} correct   {row.name}")

        yield step

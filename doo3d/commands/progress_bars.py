"""Show progress bars on stderr if that is a terminal: the common base, and the simple bars."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping, Sized
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from rich.progress import Progress

T = TypeVar("T")

_drawn: list[Progress] = []  # the displays that are or have been on the screen

_NARROW_COLUMNS = 60
"""Characters per line below which a bar shows only the number of frames; its other texts take 40 characters."""


def has_bar(total: int) -> bool:
    """Return whether work of `total` steps gets a bar: with two or more steps, and if stderr is a terminal."""
    return total > 1 and sys.stderr.isatty()


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Delay Ctrl-C to the end of the `with` block, since it would leave double lines or half a bar while drawing."""
    former = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(former):
        yield
        return
    pressed: list[Any] = []
    signal.signal(signal.SIGINT, lambda *arguments: pressed.append(arguments))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, former)
        if pressed:
            former(*pressed[0])


@contextmanager
def progress_display(*texts: str) -> Iterator[Progress]:
    """Yield a display of one line: bar, number of steps, time left and further texts, for a `with` block.

    The display leaves nothing on the screen. A narrow
    terminal shows the bar and the number of steps only. `texts` are templates of
    rich's TextColumn, such as "{task.fields[status]}".
    """
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
    from rich.table import Column

    console = Console(stderr=True)
    console.width -= len("^C")  # which the terminal prints behind the bar, and which must not wrap
    counted = (
        BarColumn(bar_width=None if console.width < _NARROW_COLUMNS else 40),
        MofNCompleteColumn(table_column=Column(no_wrap=True)),
    )
    further = (TimeRemainingColumn(), *(TextColumn(text, table_column=Column(no_wrap=True)) for text in texts))
    columns = counted if console.width < _NARROW_COLUMNS else (*counted, *further)
    progress = Progress(*columns, console=console, auto_refresh=False, transient=True, redirect_stdout=False)
    _drawn.append(progress)
    try:
        with uninterrupted():
            progress.start()
        yield progress
    finally:
        with uninterrupted():
            progress.stop()


def remove_bars() -> None:
    """Remove the bars from the screen after Ctrl-C, which leaves their iterators before the end.

    On Ctrl-C, a terminal discards pending output, which may be the end of a bar; therefore the line is cleared once more.
    """
    if not _drawn:
        return
    from rich.control import Control
    from rich.segment import ControlType

    for progress in _drawn:
        progress.stop()
    console = _drawn[-1].console
    console.control(Control(ControlType.CARRIAGE_RETURN, (ControlType.ERASE_IN_LINE, 2)))
    console.show_cursor(True)


def with_progress(items: Iterable[T], total: int | None = None) -> Iterable[T]:
    """Return an iterable over `items` that shows a bar while iterating; without a terminal, `items` unchanged.

    `total` is the number of items; None for the length of a sequence.
    """
    if total is None:
        assert isinstance(items, Sized)
        total = len(items)
    return _stepping(items, total) if has_bar(total) else items


def _stepping(items: Iterable[T], total: int) -> Iterator[T]:
    with progress_display() as progress:
        with uninterrupted():
            task = progress.add_task("", total=total)
            progress.refresh()
        for item in items:
            yield item
            with uninterrupted():
                progress.update(task, advance=1, refresh=True)


@contextmanager
def counting(total: int) -> Iterator[Callable[[Mapping[str, Any]], None]]:
    """Yield a function that advances a progress bar by one frame of an evaluation, for the duration of a `with` block.

    Call the function with the record of each finished frame. The bar is on stderr and shows the number of correct frames
    so far. `total` is the number of frames. Without a terminal, or if `total` is below 2, the function does nothing.
    """
    if not has_bar(total):
        yield lambda result: None
        return
    with progress_display("{task.fields[status]}") as progress:
        with uninterrupted():
            task, correct = progress.add_task("", total=total, status=""), 0
            progress.refresh()

        def advance(result: Mapping[str, Any]) -> None:
            nonlocal correct
            correct += result["correct"]
            with uninterrupted():
                progress.update(task, advance=1, refresh=True, status=f"{correct} correct   {result['frame']}")

        yield advance

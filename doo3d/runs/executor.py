"""What a run asks of whoever does its work."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol


class WorkerLost(Exception):
    """The work cannot be done: whoever does it dies. The message is a sentence, and `code` that of the frame's error."""

    code = "worker-lost"


class Future(Protocol):
    """Work that was handed out."""

    def result(self) -> Any:
        """Wait for it.

        Raises
        ------
        WorkerLost : its worker died, again and again. InputError : there are no workers any more.
        """
        ...


class Executor(Protocol):
    """workers : how many frames are worked on at once. window : how many may be under way, from reading to writing."""

    workers: int
    window: int

    def submit(self, function: Callable[..., Any], *args: Any, near: Future | None = None) -> Future:
        """Hand out work; `near` names a job, already done, that left something where it was done."""
        ...

"""Who does the work of a run: this process, or the workers of a cluster. The same calls, the same results."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from ..errors import InputError
from .executor import Executor, Future


@dataclass(frozen=True)
class _Deferred:
    function: Callable[..., Any]
    args: tuple[Any, ...]

    def result(self) -> Any:
        return self.function(*self.args)


class SerialExecutor:
    """This process, one frame after the other."""

    workers, window = 1, 1

    def submit(self, function: Callable[..., Any], *args: Any, near: Future | None = None) -> Future:
        """It is done when its result is asked for."""
        return _Deferred(function, args)


@contextmanager
def executor(workers: int = 0, scheduler: str | None = None) -> Iterator[Executor]:
    """This process where `workers` is 0; else so many processes of this machine, or the workers of a running scheduler.

    Raises
    ------
    InputError : both are given, or the scheduler cannot be reached. MissingDependency : dask.distributed is not installed.
    """
    if workers and scheduler:
        raise InputError(
            f"the scheduler {scheduler} has its own workers: give either the scheduler or a number of workers",
            code="options-conflict",
        )
    if not workers and not scheduler:
        yield SerialExecutor()
        return
    from .dask_executor import local, remote

    with remote(scheduler) if scheduler else local(workers) as found:
        yield found

"""Select the executor of a run: this process, workers of this machine, or a dask scheduler. Results are the same."""

from collections.abc import Iterator
from contextlib import closing, contextmanager

from ..errors import InputError
from .executor import Executor
from .serial_executor import SerialExecutor


@contextmanager
def select_executor(workers: int = 0, scheduler: str | None = None, time_limit: float | None = None) -> Iterator[Executor]:
    """Yield the executor of a run for the duration of a `with` block.

    Give `workers` or `scheduler` or neither; the results of a run are the same.

    Parameters
    ----------
    workers
        number of worker processes to start on this machine; 0 works in this process alone.
    scheduler
        address of a running dask scheduler whose workers to use, such as tcp://host:8786.
    time_limit
        greatest time in s for a frame; None for no limit. It has no effect on the workers of a scheduler.

    Raises
    ------
    InputError : both are given, or the scheduler cannot be reached.
    MissingDependency : a scheduler is given and dask.distributed is not installed.
    """
    if workers and scheduler:
        raise InputError(
            f"the scheduler {scheduler} has its own workers: give either the scheduler or a number of workers",
            code="options-conflict",
        )
    if scheduler:
        from .dask_executor import scheduler_workers

        with scheduler_workers(scheduler) as executor:
            yield executor
    elif workers:
        from .local_executor import local_workers

        with local_workers(workers, time_limit) as executor:
            yield executor
    else:
        with closing(SerialExecutor(time_limit)) as executor:
            yield executor

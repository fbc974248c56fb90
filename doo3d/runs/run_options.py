"""How a run is done, beside its capture, folder and settings: input, workers, earlier results, and whom it tells."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

from ..inputs import ReadOptions
from .executor import Executor
from .frame_record import FrameRecord
from .pictures import ALL_PICTURES, Pictures
from .time_limit import DEFAULT_SECONDS


class Progress(Protocol):
    """Follows a run: called with each frame's record once its files are written."""

    def __call__(self, record: FrameRecord) -> None:
        """Take the record of a frame that is done."""

    def resumed(self, records: Sequence[FrameRecord]) -> None:
        """Take the records of the frames that an earlier run finished: once, before the first frame; not without any."""

    def note(self, sentence: str) -> None:
        """Take a sentence about what an earlier run left, such as the lock of a killed one."""


@dataclass(frozen=True, kw_only=True)
class RunOptions:
    """The options of a run.

    Attributes
    ----------
    reading
        the options that the capture was opened with, to be noted in the manifest; None for the defaults.
    workers
        number of worker processes to start on this machine; 0 works in this process alone. Workers do not import the calling
        script: loaders of a capture of your own have to be in a module.
    scheduler
        address of a running dask.distributed scheduler, such as tcp://host:8786, whose workers to use instead. The capture
        must have the same path on their machines.
    executor
        does the jobs, instead of one made for `workers` or `scheduler`; it stays open. None to make one.
    restart
        do all frames again, and replace results of the same capture that are in the folder, also those of other versions of doo3d
        or of an input that has changed since. Results of another configuration are replaced in any case.
    force
        write into the folder even if it holds other files, which stay, or results of another capture, which are removed.
    retry_failed
        do all frames again that failed in an earlier run. Those whose files have changed since are done again in any case.
    time_limit
        s that a frame may take, reading and rendering included; then it fails, and a worker that was busy with it is replaced.
        None for no limit. Without effect on the workers of a scheduler and on a given executor.
    pictures
        which frames get a picture. Pictures that are missing of frames that an earlier run finished are drawn from its results.
    report, resumed, note
        called as the members of `Progress`.
    """

    reading: ReadOptions | None = None
    workers: int = 0
    scheduler: str | None = None
    executor: Executor | None = None
    restart: bool = False
    force: bool = False
    retry_failed: bool = False
    time_limit: float | None = DEFAULT_SECONDS
    pictures: Pictures = ALL_PICTURES
    report: Callable[[FrameRecord], None] = lambda record: None
    resumed: Callable[[Sequence[FrameRecord]], None] = lambda records: None
    note: Callable[[str], None] = lambda sentence: None

    def with_progress(self, progress: Progress) -> RunOptions:
        """Return the options with a run's progress told to `progress`."""
        return replace(self, report=progress, resumed=progress.resumed, note=progress.note)

"""Define the options of a run: input, workers, treatment of earlier results, and progress callbacks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

from ..inputs import ReadOptions
from .choice import Choice
from .executor import Executor
from .frame_record import FrameRecord
from .pictures import ALL_PICTURES, Pictures
from .time_limit import DEFAULT_SECONDS


class Progress(Protocol):
    """The interface of an observer of a run, called with each frame's record once its files are written."""

    def __call__(self, record: FrameRecord) -> None:
        """Receive the record of a finished frame."""

    def resumed(self, records: Sequence[FrameRecord]) -> None:
        """Receive the records of the frames that an earlier run finished, if any, before the first frame."""

    def note(self, sentence: str) -> None:
        """Receive a sentence about files of an earlier run, such as the lock of a killed one."""


@dataclass(frozen=True, kw_only=True)
class RunOptions:
    """The options of a run.

    Attributes
    ----------
    reading
        the options with which the capture was opened, for the manifest; None for the defaults.
    workers
        number of worker processes to start on this machine; 0 works in this process alone. Workers do not import the calling
        script, so loaders of your own captures must be in a module.
    scheduler
        address of a running dask.distributed scheduler, such as tcp://host:8786, whose workers to use instead. The capture
        must have the same path on their machines.
    executor
        executor to use instead of one made for `workers` or `scheduler`; it stays open. None makes one.
    restart
        True processes all frames again, and replaces results of the same capture in the folder, also those of other versions of
        doo3d or of a changed input. Results of another configuration are replaced in any case.
    force
        True writes into the folder even if it holds other files, which stay, or results of another capture, which are removed.
    retry_failed
        True processes frames again that failed in an earlier run. Failed frames whose files have changed are processed again in
        any case.
    time_limit
        greatest time in s for a frame, including reading and rendering; then the frame fails, and its worker is replaced. None
        for no limit. It has no effect on the workers of a scheduler or on a given executor.
    pictures
        the choice of frames that get a picture. If an earlier run finished a frame without its picture, the picture is drawn from
        the results.
    choice
        points and a box in the first frame that choose the objects; None for all.
    report, resumed, note
        functions that are called like the members of `Progress`.
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
    choice: Choice | None = None
    report: Callable[[FrameRecord], None] = lambda record: None
    resumed: Callable[[Sequence[FrameRecord]], None] = lambda records: None
    note: Callable[[str], None] = lambda sentence: None

    def with_progress(self, progress: Progress) -> RunOptions:
        """Return the options with the callbacks of `progress`."""
        return replace(self, report=progress, resumed=progress.resumed, note=progress.note)

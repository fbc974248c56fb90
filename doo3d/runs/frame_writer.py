"""Write the files of a run's frames in order, in a thread, while further frames are processed."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from types import TracebackType
from typing import Any

from ..outputs.run_folder import ResultsFolder
from .frame_record import FrameRecord
from .helper_thread import HelperThread

MAX_WAITING = 4
"""Greatest number of frames whose files wait to be written."""


class FrameWriter:
    """The writer of a run's frames, for a `with` block, which ends when all added frames are written.

    Parameters
    ----------
    folder
        the folder of the run, which nothing else writes to meanwhile.
    """

    def __init__(self, folder: ResultsFolder) -> None:
        self.folder = folder
        self._thread = HelperThread()
        self._waiting: deque[tuple[FrameRecord | None, Future[None]]] = deque()
        self._has_failed = False

    def add(self, record: FrameRecord, files: dict[str, bytes] | None) -> None:
        """Schedule the writing of a frame's files, then of its line in the journal; files : None for a failed frame."""
        self._waiting.append((record, self._thread.submit(self._do, self.folder.add, record.name, record.to_journal(), files)))

    def keep(self, name: str) -> None:
        """Schedule the confirmation of the files of a frame in `folder.later`."""
        self._waiting.append((None, self._thread.submit(self._do, self.folder.keep, name)))

    def written(self, max_waiting: int = 0) -> Iterator[FrameRecord]:
        """Yield the records of the frames written so far, waiting until at most `max_waiting` are left to write.

        Raises
        ------
        InputError
            a file could not be written; later frames are not written either.
        """
        while self._waiting and (len(self._waiting) > max_waiting or self._waiting[0][1].done()):
            record, done = self._waiting.popleft()
            done.result()
            if record is not None:
                yield record

    def __enter__(self) -> FrameWriter:
        """Return the writer."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None) -> None:
        """Wait until all added frames are written, also after an error."""
        for _, done in self._waiting:
            done.exception()
        self._thread.close()

    def _do(self, write: Callable[..., None], *arguments: Any) -> None:
        """Call a function that writes, unless an earlier write failed."""
        if self._has_failed:
            return
        try:
            write(*arguments)
        except BaseException:
            self._has_failed = True
            raise

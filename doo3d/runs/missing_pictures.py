"""Draw the pictures of frames that an earlier run finished without one, from its results."""

from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

from ..inputs import FrameRef
from ..outputs import SUFFIXES
from ..outputs.run_folder import ResultsFolder
from ..outputs.run_reader import read_detection
from ..types.display import counted
from .executor import Executor, Future, WorkerLost
from .frame_jobs import draw_frame
from .frame_record import OK, FrameRecord
from .pictures import Pictures


def draw_missing(
    frames: Sequence[FrameRef],
    pictures: Mapping[str, Pictures],
    records: Mapping[str, FrameRecord],
    executor: Executor,
    folder: ResultsFolder,
    note: Callable[[str], None],
) -> Iterator[FrameRecord]:
    """Draw and write the wanted pictures that finished frames lack, and yield the records of these frames.

    A picture of another format counts as present. A picture that cannot be drawn is skipped with a note.

    Parameters
    ----------
    frames
        the frames of the capture.
    pictures
        name of a frame -> whether a picture is wanted, see `Pictures.at`.
    records
        the records of the frames that are finished, by name.
    executor
        executor of the jobs.
    folder
        the folder of the run.
    note
        called with sentences for the user.
    """
    missing = [frame for frame in frames if (record := records.get(frame.name)) and _is_missing(record, pictures[frame.name])]
    if missing:
        note(
            f"{counted(len(missing), 'picture')} of finished frames {'is' if len(missing) == 1 else 'are'} drawn from the results"
        )
    jobs: deque[tuple[FrameRef, str, Future]] = deque()
    for position, frame in enumerate(missing):
        kind = pictures[frame.name].kind
        detection = read_detection(folder.file(frame.name, SUFFIXES["json"]))
        jobs.append((frame, kind, executor.submit(draw_frame, [(frame, detection, kind)])))
        while jobs and (len(jobs) >= executor.max_jobs or position == len(missing) - 1):
            frame, kind, job = jobs.popleft()
            (value,) = job.result()
            files, error = ({}, str(value)) if isinstance(value, WorkerLost) else value
            if error is not None:
                note(f"{frame.name}: its picture cannot be drawn ({error})")
                continue
            record = replace(records[frame.name], picture=kind)
            folder.amend(frame.name, {"picture": kind}, files)
            yield record


def _is_missing(record: FrameRecord, pictures: Pictures) -> bool:
    return record.status == OK and record.picture is None and pictures.wants(record)

"""Process the frames of a run with an executor, in jobs of several frames; results are put in order and tracked."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from ..config import Config
from ..inputs import FrameRef
from ..track.tracking import Tracker
from .executor import Executor, Future, WorkerLost
from .frame_jobs import DetectedFrame, detect_frame, render_frame
from .frame_record import FrameRecord
from .methods import Method, detect_alone
from .pictures import ALL_PICTURES, Pictures

JOB_SECONDS = 0.6
"""Target time in s for detecting and rendering the frames of a job: long compared with the overhead of a job (7 ms with dask),
short enough that a kill loses little work."""

RECENT_FRAMES = 32
"""Number of last frames whose mean time predicts that of the next: enough for a stable mean, few enough to follow changes."""

LAST_JOBS_PER_WORKER = 4
"""Least number of jobs per worker for the remaining frames, so that all workers end at about the same time."""


EVERYTHING: Mapping[str, Pictures] = {}
"""Choice of pictures in which every frame gets one: frames that are not named do."""


class JobSize:
    """Chooses the number of frames of the next job from the times of earlier frames.

    Parameters
    ----------
    workers
        number of frames worked on at a time.
    max_frames
        largest number of frames in one job.
    """

    def __init__(self, workers: int, max_frames: int) -> None:
        self._workers, self._max_frames = workers, max_frames
        self._recent: deque[float] = deque(maxlen=RECENT_FRAMES)

    def add(self, seconds: float) -> None:
        """Add the processing time of a frame, s."""
        self._recent.append(seconds)

    def frames(self, remaining: int) -> int:
        """Return the number of frames of the next job, given those remaining; 1 as long as no time is known.

        A job takes about 0.6 s. Towards the end of the capture jobs become smaller, down to one frame.
        """
        if not self._recent:
            return 1
        mean = sum(self._recent) / len(self._recent)
        in_time = math.floor(JOB_SECONDS / mean) if mean > 0 else self._max_frames
        share = math.ceil(remaining / (LAST_JOBS_PER_WORKER * self._workers))
        return max(1, min(in_time, share, self._max_frames))


def process_frames(
    frames: Sequence[FrameRef],
    config: Config,
    executor: Executor,
    tracker: Tracker | None,
    method: Method = detect_alone,
    thorough: frozenset[str] = frozenset(),
    pictures: Mapping[str, Pictures] = EVERYTHING,
) -> Iterator[tuple[FrameRecord, dict[str, bytes] | None]]:
    """Yield the record and the files of each frame, in order, with at most `executor.max_jobs` jobs in progress.

    Tracking needs the frames in order, and pictures need the tracked chains. So a group of frames has two jobs: any worker
    detects its chains in advance, this process tracks them in order, and then a worker renders the files.

    Parameters
    ----------
    frames
        the frames, in the capture's order.
    config
        configuration of the detection.
    executor
        executor of the jobs.
    tracker
        gives chains their ids; None for frames that are not a sequence.
    method
        the function that finds the chains of a frame.
    thorough
        names of the frames to check thoroughly; see `detect_frame`.
    pictures
        name of a frame -> whether it gets a picture, see `Pictures.at`; frames that are not named get one.
    """
    size = JobSize(executor.workers, executor.max_frames_per_job)
    detecting: deque[tuple[Sequence[FrameRef], Future]] = deque()
    rendering: deque[_Rendering] = deque()
    submitted = 0
    while True:
        while len(detecting) + len(rendering) < executor.max_jobs and submitted < len(frames):
            group = frames[submitted : submitted + size.frames(len(frames) - submitted)]
            calls = [(frame, config, method, frame.name in thorough) for frame in group]
            detecting.append((group, executor.submit(detect_frame, calls)))
            submitted += len(group)
        has_work = bool(detecting) and (executor.works_here or detecting[0][1].done())
        if (rendering and not has_work) or (rendering and executor.works_here and rendering[0].done()):
            for record, files in rendering.popleft().results():
                size.add(record.seconds)
                yield record, files
        elif detecting:
            try:
                rendering.append(_Rendering(*detecting.popleft(), executor, tracker, pictures))
            except KeyboardInterrupt:
                if executor.works_here:  # the frames before are as good as done
                    for detected in rendering:
                        yield from detected.results()
                raise
        else:
            return


class _Rendering:
    """A group of frames that are detected and tracked, and whose files are being made.

    Parameters
    ----------
    frames
        the group.
    job
        the job that detects them.
    executor
        renders them.
    tracker
        tracker of their chains; None if they are not tracked.
    pictures
        name of a frame -> whether it gets a picture.
    """

    def __init__(
        self,
        frames: Sequence[FrameRef],
        job: Future,
        executor: Executor,
        tracker: Tracker | None,
        pictures: Mapping[str, Pictures],
    ) -> None:
        self._frames = frames
        self._detected = [_tracked(frame, value, tracker) for frame, value in zip(frames, job.result(), strict=True)]
        pairs = zip(frames, self._detected, strict=True)
        calls = [(frame, each, pictures.get(frame.name, ALL_PICTURES)) for frame, each in pairs if each.detection is not None]
        self._job = executor.submit(render_frame, calls, job) if calls else None

    def done(self) -> bool:
        """Return whether the files are made."""
        return self._job is None or self._job.done()

    def results(self) -> Iterator[tuple[FrameRecord, dict[str, bytes] | None]]:
        """Wait for the files, and yield the record and the files of each frame; a frame that failed has no files."""
        rendered = iter(self._job.result() if self._job is not None else ())
        for frame, detected in zip(self._frames, self._detected, strict=True):
            if detected.detection is None:
                yield detected.record, None
            elif isinstance(value := next(rendered), WorkerLost):
                yield FrameRecord.failed(frame, str(value), value.code), None
            else:
                yield value


def _tracked(frame: FrameRef, value: Any, tracker: Tracker | None) -> DetectedFrame:
    """Return the result of `detect_frame` with the ids of the chains; a failed frame if its worker was lost."""
    if isinstance(value, WorkerLost):
        return DetectedFrame(FrameRecord.failed(frame, str(value), value.code))
    detected: DetectedFrame = value
    if detected.detection is None or tracker is None:
        return detected
    return replace(detected, detection=tracker.update(detected.detection))

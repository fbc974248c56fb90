"""The frames of a run, handed to an executor in jobs of several frames; what comes back is put in order and tracked."""

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
"""s that detecting and rendering the frames of a job take together: long beside what a job costs (7 ms with dask), short beside
what a user would miss after a kill."""

RECENT_FRAMES = 32
"""Frames whose mean time predicts that of the next: enough to even out, few enough to follow a capture that changes."""

LAST_JOBS_PER_WORKER = 4
"""Jobs that the remaining frames are divided into at least, per worker, so that all workers end at about the same time."""


EVERYTHING: Mapping[str, Pictures] = {}
"""No frame is named, so a picture is drawn of each."""


class JobSize:
    """The number of frames of the next job, from the time that the frames so far took.

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
        """Note the time that a frame took, s."""
        self._recent.append(seconds)

    def frames(self, remaining: int) -> int:
        """Return the number of frames of the next job, of which `remaining` are left; 1 as long as no time is known.

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

    Tracking needs the frames in order, and pictures the tracked chains. So a group of frames has two jobs: frames are detected
    ahead by any worker, then tracked in order by this process, then rendered.

    Parameters
    ----------
    frames
        the frames, in the capture's order.
    config
        configuration of the detection.
    executor
        does the jobs.
    tracker
        gives chains their ids; None for frames that are not a sequence.
    method
        how the chains of a frame are found.
    thorough
        names of the frames to look at thoroughly; see `detect_frame`.
    pictures
        name of a frame -> whether a picture is drawn, see `Pictures.at`; one is drawn of frames that are not named.
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
        tracks their chains; None: they are not tracked.
    pictures
        whether pictures are drawn, by the names of the frames.
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

"""Frames are handed out in jobs of several, sized by their measured time, and come back in order."""

from pathlib import Path

import pytest

from doo3d.config import Config
from doo3d.inputs import FrameData, FrameRef
from doo3d.runs.executor import WorkerLost, do_calls
from doo3d.runs.frame_cache import FrameCache
from doo3d.runs.frame_jobs import detect_frame
from doo3d.runs.process_frames import JobSize, process_frames
from doo3d.track.tracking import Tracker
from doo3d.types import Cloud

pytestmark = pytest.mark.usefixtures("fake_detection")


def test_a_job_holds_as_many_frames_as_take_its_time():
    size = JobSize(workers=2, max_frames=64)
    assert size.frames(10_000) == 1  # nothing is measured yet
    for seconds, frames in ((0.035, 17), (0.19, 3), (5.0, 1), (0.001, 64), (0.0, 64)):
        for _ in range(40):
            size.add(seconds)
        assert size.frames(10_000) == frames


def test_a_slow_frame_among_many_does_not_make_jobs_of_one_frame():
    size = JobSize(workers=1, max_frames=64)
    for seconds in (1.0, *31 * [0.019]):
        size.add(seconds)
    assert size.frames(10_000) == 12
    size.add(0.019)  # the slow one is forgotten
    assert size.frames(10_000) == 31


@pytest.mark.parametrize("workers", [1, 2, 8])
def test_jobs_become_smaller_towards_the_end(workers):
    size, remaining, jobs = JobSize(workers, max_frames=64), 500, []
    size.add(0.019)
    while remaining:
        jobs.append(size.frames(remaining))
        remaining -= jobs[-1]
    assert sum(jobs) == 500
    assert jobs == sorted(jobs, reverse=True)
    assert max(jobs) >= 500 // (4 * workers) or max(jobs) == 31
    assert jobs[-3 * workers :] == 3 * workers * [1]


class Shuffled:
    """An executor whose jobs are done in another order than they came in; frames named in `lost` kill their worker."""

    workers, max_frames_per_job, works_here = 2, 64, False

    def __init__(self, max_jobs, lost=()):
        self.max_jobs, self.lost = max_jobs, lost
        self.sizes, self.open, self.most = [], 0, 0

    def submit(self, function, calls, affinity=None):
        self.sizes.append((function.__name__, len(calls)))
        self.open += 1
        self.most = max(self.most, self.open)
        return Job(self, function, calls)


class Job:
    def __init__(self, executor, function, calls):
        self.executor, self.function, self.calls = executor, function, calls

    def done(self):
        return len(self.executor.sizes) % 3 == 0

    def result(self):
        self.executor.open -= 1
        return [
            WorkerLost("twice") if (self.function.__name__, frame.name) in self.executor.lost else value
            for (frame, *_), value in zip(self.calls, do_calls(FrameCache(), self.function, self.calls), strict=True)
        ]


def references(count):
    def load():
        return FrameData(Cloud([[0.0, 0.0, 1.0]]))

    return [FrameRef(f"{i:03d}", Path("cloud.ply"), load) for i in range(count)]


def processed(executor, count=50, tracker=None):
    return list(process_frames(references(count), Config(), executor, tracker))


def test_frames_come_back_in_order_from_jobs_of_several():
    executor = Shuffled(max_jobs=6)
    made = processed(executor)
    assert [record.name for record, _ in made] == [f"{i:03d}" for i in range(50)]
    assert all(files.keys() == {".json", ".jpg"} for _, files in made)
    assert executor.most <= 6
    assert executor.open == 0
    for name in ("detect_frame", "render_frame"):
        sizes = [size for function, size in executor.sizes if function == name]
        assert sum(sizes) == 50
        assert max(sizes) > 1


def test_only_the_frames_that_were_lost_fail():
    executor = Shuffled(max_jobs=6, lost={("detect_frame", "010"), ("detect_frame", "011"), ("render_frame", "020")})
    made = processed(executor)
    failed = {record.name: record.code for record, files in made if files is None}
    assert failed == dict.fromkeys(("010", "011", "020"), "worker-lost")
    assert [record.name for record, _ in made] == [f"{i:03d}" for i in range(50)]


def test_a_job_all_of_whose_frames_fail_has_nothing_to_render(monkeypatch):
    monkeypatch.setattr(JobSize, "frames", lambda self, remaining: 2)
    executor = Shuffled(max_jobs=2, lost={("detect_frame", "000"), ("detect_frame", "001")})
    assert [record.status for record, _ in processed(executor, 4)] == ["failed", "failed", "ok", "ok"]
    assert [name for name, _ in executor.sizes].count("render_frame") == 1


def test_frames_are_tracked_in_order():
    class Noting(Tracker):
        names = ()

        def update(self, detection):
            self.names += (detection.frame,)
            return super().update(detection)

    tracker = Noting()
    processed(Shuffled(max_jobs=6, lost={("detect_frame", "007")}), 30, tracker)
    assert tracker.names == tuple(f"{i:03d}" for i in range(30) if i != 7)


def test_no_frames():
    executor = Shuffled(max_jobs=6)
    assert processed(executor, 0) == []
    assert executor.sizes == []


def test_a_frame_is_detected_whatever_its_loader_raises():
    def load():
        raise ZeroDivisionError

    assert detect_frame(FrameCache(), FrameRef("a", Path("a.ply"), load), Config()).record.code == "file-damaged"

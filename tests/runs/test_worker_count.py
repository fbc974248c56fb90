"""The number of worker processes: as given, or as many as processors, memory and frames allow."""

import math

import pytest
from builders.errors import refuses

import doo3d
from doo3d.runs import worker_count as counting
from doo3d.runs.worker_count import FRAMES_PER_WORKER, WORKER_BYTES, worker_count


@pytest.fixture
def machine(monkeypatch):
    def of(processors, workers_in_memory):
        monkeypatch.setattr(counting, "usable_processors", lambda: processors)
        monkeypatch.setattr(counting, "_usable_bytes", lambda: WORKER_BYTES * workers_in_memory)

    return of


@pytest.mark.parametrize(("given", "count"), [(0, 0), (3, 3), ("0", 0), ("12", 12)])
def test_a_number_is_taken_as_it_is(machine, given, count):
    machine(1, 1)
    assert worker_count(given, 1) == count


@pytest.mark.parametrize(
    ("processors", "in_memory", "frames", "count"),
    [
        (8, math.inf, 10_000, 8),
        (8, 3.5, 10_000, 3),
        (8, math.inf, 5 * FRAMES_PER_WORKER, 5),
        (8, math.inf, 2 * FRAMES_PER_WORKER - 1, 0),
        (1, math.inf, 10_000, 0),
        (8, 0.1, 10_000, 0),
        (8, math.inf, 0, 0),
    ],
)
def test_auto_is_bounded_by_processors_memory_and_frames(machine, processors, in_memory, frames, count):
    machine(processors, in_memory)
    assert worker_count("auto", frames) == count


@pytest.mark.parametrize("given", ["many", "-1", "1.5", ""])
def test_anything_else_is_refused(given):
    with refuses("value-invalid", "auto"):
        worker_count(given, 10)


def test_what_this_machine_has():
    assert counting.usable_processors() >= 1
    assert counting._usable_bytes() > 0


@pytest.mark.usefixtures("fake_detection")
def test_a_short_run_with_auto_needs_no_workers(capture, tmp_path, doo3d):
    code, _, err = doo3d("detect", capture(frames=2), "-o", "out", "--workers", "auto")
    assert code == 0, err
    assert doo3d("detect", capture("other"), "-o", "other", "--workers", "some")[0] == 2


@pytest.mark.usefixtures("fake_detection")
def test_python_has_auto(capture, tmp_path):
    assert doo3d.run(capture(frames=2), tmp_path / "out", workers="auto").succeeded == 2
    with refuses("value-invalid", "workers"):
        doo3d.run(capture("other"), tmp_path / "other", workers="some")

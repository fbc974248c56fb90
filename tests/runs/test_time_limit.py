"""A frame that takes too long fails; a worker that hangs or is stopped is replaced."""

import os
import signal
import sys
import threading
import time

import pytest
from builders.runs import files_of, finished_frames, started, wait_for

from doo3d.config import Config
from doo3d.errors import InputError
from doo3d.inputs import open_capture
from doo3d.runs import run as batch
from doo3d.runs import time_limit as limits
from doo3d.runs.executor import WorkerTooSlow
from doo3d.runs.local_executor import local_workers
from doo3d.runs.serial_executor import SerialExecutor

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals")


def test_a_frame_that_hangs_fails_and_the_others_do_not(capture, tmp_path, fake_detection):
    inner = fake_detection["do"]
    fake_detection["do"] = lambda data, config, mask: (data.name == "000001" and time.sleep(30), inner(data, config, mask))[1]
    start = time.monotonic()
    summary = batch.run(open_capture(capture(frames=3)), tmp_path / "out", Config(), batch.RunOptions(time_limit=0.5))
    assert time.monotonic() - start < 10
    assert [record.code for record in summary.records] == [None, "time-limit", None]
    assert "0.5 s" in summary.records[1].error
    assert signal.getsignal(signal.SIGALRM) == signal.SIG_DFL


def test_the_limit_is_given_in_the_shell(doo3d, capture, fake_detection):
    inner = fake_detection["do"]
    fake_detection["do"] = lambda data, config, mask: (data.name == "000000" and time.sleep(30), inner(data, config, mask))[1]
    code, _, err = doo3d("detect", capture(frames=2), "--time-limit", "0.4")
    assert code == 1
    assert "000000   failed: took longer than 0.4 s" in err
    assert "--retry-failed --time-limit 4 [time-limit]" in err


def test_a_pipe_among_the_images_is_refused(capture):
    folder = capture(frames=2)
    (folder / "depth" / "000000.png").unlink()
    os.mkfifo(folder / "depth" / "000000.png")
    with pytest.raises(InputError, match="is a device or a pipe, expected a file"):
        open_capture(folder)


def test_a_frame_that_catches_the_interruption_is_interrupted_again(monkeypatch):
    monkeypatch.setattr(limits, "_AGAIN_SECONDS", 0.1)

    def stubborn(cache):
        try:
            time.sleep(30)
        except limits.TimeLimitReached:
            time.sleep(30)

    (value,) = SerialExecutor(0.2).submit(stubborn, [()]).result()
    assert isinstance(value, WorkerTooSlow)


def test_time_during_which_the_process_is_stopped_does_not_count():
    code = """
import time
from doo3d.runs.time_limit import time_limit
with time_limit(1.5):
    print("begun", flush=True)
    for _ in range(10):
        time.sleep(0.1)
print("finished")
"""
    process = started(sys.executable, "-c", code)
    process.stdout.readline()
    process.send_signal(signal.SIGSTOP)
    time.sleep(5)
    process.send_signal(signal.SIGCONT)
    assert process.communicate()[0] == "finished\n"


def test_other_threads_and_other_alarms_are_left_alone():
    done = []

    def beside():
        with limits.time_limit(0.01):
            time.sleep(0.1)
        done.append(True)

    thread = threading.Thread(target=beside)
    thread.start()
    thread.join()
    rung = []
    before = signal.signal(signal.SIGALRM, lambda *args: rung.append(True))
    try:
        with limits.time_limit(0.01):
            time.sleep(0.1)
    finally:
        signal.signal(signal.SIGALRM, before)
    assert (done, rung) == ([True], [])


def slept(cache, seconds):
    time.sleep(seconds)
    return os.getpid()


def stopped(cache, seconds):
    os.kill(os.getpid(), signal.SIGSTOP)


@pytest.mark.slow
@pytest.mark.parametrize("hangs", [slept, stopped])
def test_a_worker_that_hangs_or_is_stopped_is_replaced(hangs):
    with local_workers(2, time_limit=1.5) as executor:
        start = time.monotonic()
        job, beside = executor.submit(hangs, [(60,)]), executor.submit(slept, [(0.1,)])
        assert beside.result() != [os.getpid()]
        (value,) = job.result()
        assert isinstance(value, WorkerTooSlow)
        assert (value.code, "1.5 s" in str(value)) == ("time-limit", True)
        assert time.monotonic() - start < 30
        again = [executor.submit(slept, [(0.5,)]) for _ in range(2)]
        assert len({job.result()[0] for job in again}) == 2


@pytest.mark.slow
def test_the_other_calls_of_a_slow_job_are_done_again():
    with local_workers(1, time_limit=1.5) as executor:
        values = executor.submit(slept, [(0.1,), (60,), (0.1,)]).result()
    assert [isinstance(value, WorkerTooSlow) for value in values] == [False, True, False]


@pytest.mark.slow
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="/proc")
def test_a_run_goes_on_when_a_worker_is_stopped(frames, expected, tmp_path):
    """Its job has several frames or is done again: none of them is lost, unless it was alone in its job."""
    from test_executors import children

    out = tmp_path / "out"
    process = started("doo3d", "detect", frames, "-o", out, "--workers", 2, "--time-limit", 3)
    wait_for(lambda: finished_frames(out) >= 2)
    for worker in children(process.pid)[-1:]:
        os.kill(worker, signal.SIGSTOP)
    output, _ = process.communicate(timeout=120)
    assert process.returncode == 1, output
    again = started("doo3d", "detect", frames, "-o", out, "--retry-failed")
    again.communicate()
    assert files_of(out) == expected

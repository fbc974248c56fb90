"""Ctrl-C: one line with the command to go on, and exit code 130."""

import os
import shlex
import signal
import sys

import pytest
from builders.runs import files_of, finished_frames, started, wait_for

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals")


def test_the_line_names_what_is_finished_and_the_command(doo3d, capture, fake_detection):
    folder = capture("my capture", frames=4)
    with fake_detection.failing(KeyboardInterrupt, "000002"):
        code, _, err = doo3d("detect", folder, "--restart")
    assert code == 130
    assert err == f"doo3d: interrupted: 2 of 4 frames are finished; to go on: doo3d detect '{folder}'\n"
    code, _, err = doo3d(*shlex.split(err.split("to go on: doo3d ")[1]))
    assert code == 0
    assert "2 frames are finished already" in err


@pytest.mark.parametrize("command", [("info",), ("detect", "-q")])
def test_other_commands_and_other_moments(doo3d, capture, monkeypatch, command):
    from doo3d import inputs

    def interrupts(*args, **kwargs):
        raise KeyboardInterrupt

    monkeypatch.setattr(inputs, "open_capture", interrupts)
    code, out, err = doo3d(*command, capture())
    assert (code, out) == (130, "")
    assert err.startswith("doo3d: interrupted")
    assert err.count("\n") == 1


@pytest.mark.parametrize("command", [("info",), ("detect", "-q")])
@pytest.mark.parametrize("raised", [ImportError, SystemError])
def test_a_module_that_is_interrupted_while_it_is_loaded(doo3d, capture, monkeypatch, command, raised):
    """A compiled module ends with an error of its own then, as SciPy's do; another such error stays what it is."""
    from doo3d import inputs

    def interrupted(*args, **kwargs):
        try:
            try:
                raise KeyboardInterrupt
            except KeyboardInterrupt as interrupt:
                raise raised("initialization failed") from interrupt
        except raised as first:
            raise ImportError("cannot import name 'fft'") from first

    def broken(*args, **kwargs):
        raise raised("initialization failed")

    folder = capture()
    monkeypatch.setattr(inputs, "open_capture", interrupted)
    code, _, err = doo3d(*command, folder)
    assert code == 130
    assert err.count("\n") == 1
    monkeypatch.setattr(inputs, "open_capture", broken)
    with pytest.raises(raised, match="initialization failed"):
        doo3d(*command, folder)


@pytest.mark.slow
@pytest.mark.parametrize("workers", [0, 2])
def test_sigterm_ends_with_a_line_and_a_run_to_go_on_with(frames, expected, tmp_path, workers):
    out = tmp_path / "out"
    command = ("doo3d", "detect", frames, "-o", out, "--workers", workers, "--quiet")
    process = started(*command)
    wait_for(lambda: finished_frames(out) >= 2)
    process.terminate()
    output, _ = process.communicate(timeout=60)
    assert process.returncode == 143, output
    assert output.splitlines()[-1].startswith("doo3d: terminated: "), output
    again = started(*command)
    again.communicate()
    assert files_of(out) == expected


@pytest.mark.slow
@pytest.mark.parametrize("workers", [0, 2])
@pytest.mark.parametrize("moment", ["start", "frames"])
def test_one_line_from_a_terminal(frames, expected, tmp_path, workers, moment):
    """A terminal sends Ctrl-C to all processes of the run."""
    out = tmp_path / "out"
    command = ("doo3d", "detect", frames, "-o", out, "--workers", workers, "--quiet")
    process = started(*command, start_new_session=True)
    wait_for(out.exists if moment == "start" else lambda: finished_frames(out) >= 2)
    os.killpg(process.pid, signal.SIGINT)
    output, _ = process.communicate(timeout=60)
    assert process.returncode == 130, output
    told = [line for line in output.splitlines() if " failed: " not in line]  # the damaged frame may have come before
    assert len(told) == 1, output
    assert "to go on: doo3d detect" in output or moment == "start"
    again = started(*command)
    again.communicate()
    assert files_of(out) == expected

"""Threads beside the detection."""

import subprocess
import sys
import threading
import time

import pytest

from doo3d.runs.helper_thread import HelperThread

HANGS = """
import sys
import numpy as np
from doo3d import cli, kernels
from doo3d.runs.helper_thread import HelperThread

def work():
    mask = np.random.default_rng(0).random((720, 1280)) < 0.3
    while True:
        kernels.medial_axis(mask)

thread = HelperThread()
thread.submit(work)
thread.close()
sys.argv = ["doo3d", *sys.argv[1:]]
cli.process()
"""


@pytest.mark.slow
@pytest.mark.parametrize(("argument", "code"), [("--version", 0), ("--no-such-option", 2)])
def test_a_thread_that_never_ends_leaves_the_exit_code_and_what_was_printed(argument, code):
    start = time.monotonic()
    done = subprocess.run([sys.executable, "-c", HANGS, argument], capture_output=True, text=True, timeout=60)
    assert done.returncode == code, done.stderr
    assert "doo3d" in done.stdout + done.stderr
    assert time.monotonic() - start < 30


def test_an_interrupt_while_the_thread_starts_stays_an_interrupt(monkeypatch):
    def interrupted(self):
        raise KeyboardInterrupt

    monkeypatch.setattr(threading.Thread, "start", interrupted)
    thread = HelperThread()
    with pytest.raises(KeyboardInterrupt):
        thread.submit(print)
    thread.close()

"""The process for native readers: where it cannot be started, and in a process that was forked beside a working thread."""

import errno
import os
import subprocess
import sys

import pytest
from builders.errors import refuses

from doo3d.guard import isolation
from doo3d.guard.isolation import isolated


def test_no_process_can_be_started(monkeypatch):
    def no_process(*args, **kwargs):
        raise OSError(errno.EMFILE, os.strerror(errno.EMFILE))

    monkeypatch.setattr(isolation, "_processes", {})
    monkeypatch.setattr(subprocess, "Popen", no_process)
    with refuses("file-unreadable", "a.ply", "Too many open files"):
        isolated(len, "a", where="a.ply")


FORKED = """
import os, threading, warnings
from doo3d.guard import isolation
from doo3d.inputs.support import native_output

held, done = threading.Event(), threading.Event()

def hold():
    with isolation._lock, native_output._ONE_AT_A_TIME:
        held.set()
        done.wait()

threading.Thread(target=hold).start()
held.wait()
warnings.simplefilter("ignore", DeprecationWarning)
child = os.fork()
if child == 0:
    with native_output.capture_native_output():
        pass
    os._exit(isolation.isolated(len, "a", where="a"))
print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
done.set()
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
def test_a_process_forked_beside_a_thread_that_reads():
    done = subprocess.run([sys.executable, "-c", FORKED], capture_output=True, text=True, timeout=120)
    assert (done.stdout, done.stderr) == ("1\n", "")

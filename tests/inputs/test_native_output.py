"""What libraries write is captured, and what other threads write meanwhile is not."""

from __future__ import annotations

import subprocess
import sys

CODE = """
import ctypes, os, sys, threading
from doo3d.inputs.support.native_output import capture_native_output

library = lambda: os.write(2, b"of the library\\n")
printed = threading.Event()

def other():
    print("a line of another thread")
    sys.stdout.flush()
    print("an error of another thread", file=sys.stderr)
    printed.set()

with capture_native_output() as captured:
    library()
    print("of Python")
    threading.Thread(target=other).start()
    printed.wait()
print(repr(captured.text))
print("after", file=sys.stderr)
with capture_native_output() as outer:
    with capture_native_output() as inner:
        library()
print(repr((outer.text, inner.text)))
"""


def test_output_of_the_library_is_captured_and_that_of_other_threads_is_not():
    done = subprocess.run([sys.executable, "-c", CODE], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == [
        "a line of another thread",
        repr("of the library\nof Python"),
        repr(("", "of the library")),
    ]
    assert done.stderr == "an error of another thread\nafter\n"


THREADS = """
import gc, sys, threading
from concurrent.futures import ThreadPoolExecutor
from doo3d.inputs.support.native_output import capture_native_output

kept = []
together = threading.Barrier(4)

def read(number):
    together.wait()
    with capture_native_output() as captured:
        print(f"of call {number}", end="")
        kept.append(sys.stdout)
    return captured.text

before = sys.stdout
with ThreadPoolExecutor(4) as threads:
    texts = list(threads.map(read, range(40)))
assert texts == [f"of call {number}" for number in range(40)], texts
assert sys.stdout is before
kept[0].close()
kept[0].write("a late text\\n")
del kept[:]
gc.collect()
print("stdout is open")
"""


def test_threads_that_capture_at_the_same_time_leave_stdout_open():
    done = subprocess.run([sys.executable, "-c", THREADS], capture_output=True, text=True)
    assert (done.stdout, done.stderr) == ("a late text\nstdout is open\n", "")

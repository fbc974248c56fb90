"""Call native readers, and networks for the first time, in a separate process, since such libraries may crash.

One process serves all calls: it starts with the first one, which takes a second, and ends with this process.
"""

from __future__ import annotations

import atexit
import os
import pickle
import signal
import struct
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import IO, Any, TypeVar

from ..errors import InputError
from .limits import current_limits

LENGTH = struct.Struct("<Q")
"""Prefix of each message in a pipe: its length in bytes."""

_END_SECONDS = 5.0  # for an aborted process to end, which may write its memory to disk
_COMMAND = "from doo3d.guard.isolated_process import main; main()"
_lock = threading.Lock()
_processes: dict[int, _Process] = {}  # by the number of this process: a forked one must not share its parent's

T = TypeVar("T")


def _renew_lock() -> None:
    """Make a new lock in a forked process, since a thread of its parent may have held the old one."""
    global _lock
    _lock = threading.Lock()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_renew_lock)


def isolated(
    function: Callable[..., T],
    *args: Any,
    where: str,
    code: str = "file-damaged",
    memory: int | None = None,
    seconds: float | None = None,
) -> T:
    """Call a function in the separate process, and return its value.

    Parameters
    ----------
    function
        importable function of a module, with a picklable value.
    *args
        its arguments, picklable.
    where
        the file that is read, named in errors.
    code
        code of the errors.
    memory
        greatest memory of the call in bytes, on platforms that support a limit (Linux); None for the need of a cloud of
        `Limits.max_points`.
    seconds
        time in s after which the process is ended; None for no limit.

    Raises
    ------
    InputError : the library ended the process, as some do for damaged files, or did not answer in time. Errors of doo3d that
        the function raises pass unchanged.
    """
    if not sys.executable:  # Python inside of another program
        return function(*args)
    with _lock:
        process = _processes.get(os.getpid())
        if process is None or not process.is_alive():
            _processes.clear()
            try:
                process = _processes[os.getpid()] = _Process()
            except OSError as error:  # no file descriptor, process or memory is left
                reason = f"no process for the library that reads it can be started ({error.strerror or error})"
                raise InputError(f"{where}: {reason}", code="file-unreadable") from error
        try:
            kind, value = process.call((function, args, current_limits(), os.getcwd(), where, memory), seconds)
        except (EOFError, BrokenPipeError, pickle.UnpicklingError):
            reason = process.end(is_ending=True)
            fault = f"ended on it ({reason})" if process.in_time else f"gave no answer within {seconds:g} s"
            raise InputError(f"{where}: is damaged: the library that reads it {fault}", code=code) from None
        except BaseException:  # such as an interrupt, or the end of a frame's time
            process.end()
            raise
    if kind == "error":
        raise value
    result: T = value
    return result


class _Process:
    """The separate process, its pipes, and the output of its libraries."""

    def __init__(self) -> None:
        paths = [path or os.getcwd() for path in sys.path if isinstance(path, str)]
        surroundings = {**os.environ, "PYTHONPATH": os.pathsep.join(paths), "PYTHONSAFEPATH": "1"}
        self._printed: IO[bytes] = tempfile.TemporaryFile()
        try:
            self._process = subprocess.Popen(
                [sys.executable, "-c", _COMMAND],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._printed,
                env=surroundings,
            )
        except BaseException:
            self._printed.close()
            raise
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._to, self._from = self._process.stdin, self._process.stdout
        self._printed_before = 0
        self.in_time = True
        atexit.register(self.end)

    def is_alive(self) -> bool:
        """Return whether the process runs."""
        return self._process.poll() is None

    def call(self, request: Any, seconds: float | None = None) -> Any:
        """Send a request and return the answer: ("value", value) or ("error", error).

        If there is no answer after `seconds`, the process is killed, and `in_time` becomes False.
        """
        self._printed_before = os.fstat(self._printed.fileno()).st_size
        timer = threading.Timer(seconds or 0.0, self._kill_late)
        if seconds is not None:
            timer.start()
        try:
            send(self._to, request)
            return receive(self._from)
        finally:
            timer.cancel()

    def _kill_late(self) -> None:
        self.in_time = False
        self._process.kill()

    def end(self, is_ending: bool = False) -> str:
        """End the process and return the reason: the last output of its library, or the signal.

        is_ending : whether the process ends by itself, so that its signal will soon be known.
        """
        if is_ending:
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(_END_SECONDS)
        self._process.kill()
        code = self._process.wait()
        for pipe in (self._to, self._from):
            try:
                pipe.close()
            except BrokenPipeError:
                pass
        words = ""
        if not self._printed.closed:
            self._printed.seek(0, os.SEEK_END)
            self._printed.seek(max(self._printed.tell() - 2000, self._printed_before))
            words = self._printed.read().decode(errors="replace").strip()
            self._printed.close()
        atexit.unregister(self.end)
        if words and code not in (-signal.SIGSEGV, -signal.SIGFPE):  # before these a library says nothing about them
            return " ".join(words.splitlines()[-1].split())[:200]
        return signal.Signals(-code).name if code < 0 and code != -signal.SIGKILL else f"exit code {code}"


def send(pipe: IO[bytes], message: Any) -> None:
    """Write a message into a pipe."""
    data = pickle.dumps(message, protocol=pickle.HIGHEST_PROTOCOL)
    pipe.write(LENGTH.pack(len(data)))
    pipe.write(data)
    pipe.flush()


def receive(pipe: IO[bytes]) -> Any:
    """Read a message from a pipe; EOFError if the other end is closed."""
    head = pipe.read(LENGTH.size)
    if len(head) < LENGTH.size:
        raise EOFError
    length = LENGTH.unpack(head)[0]
    data = pipe.read(length)
    if len(data) < length:
        raise EOFError
    return pickle.loads(data)

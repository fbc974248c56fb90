"""Faults at the file operations of a run: the process is killed there, or the system refuses.

A run is a forked process, so that libraries are loaded once. In it, the functions that write files are wrapped: operations on the
folder of the results are counted, and something happens at the one that was asked for. Workers, which write nothing, are not
concerned, nor are the pipes to them: with an error there, which no disk makes, multiprocessing waits for its tracker forever.
"""

from __future__ import annotations

import errno
import io
import os
import signal
import stat
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

FUNCTIONS = ("open", "replace", "unlink", "mkdir", "rmdir", "fsync", "write", "ftruncate", "utime")
"""Functions of the module os that are operations."""

METHODS = ("write", "flush", "truncate")
"""Methods of open files that are operations."""

KILLS = ("before", "torn", "after")
LOCK = threading.Lock()  # files are written by more than one thread
ERRORS = ("ENOSPC", "EACCES", "EIO")


@dataclass
class Fault:
    """What happens at a file operation.

    kind: "none", to count; "before", "torn" or "after", where the process is killed, "torn" with half of a write done; or the
    name of an error, such as "ENOSPC", that the operation raises. at: number of the operation, from 1. lasting: whether all
    operations after it fail as well.
    """

    kind: str = "none"
    at: int = 0
    lasting: bool = False
    count: int = 0

    def __call__(self, operation: Callable[..., Any], *args: Any, torn: Callable[[], Any] | None = None, **options: Any) -> Any:
        """Do an operation, or what is asked for instead."""
        with LOCK:
            self.count += 1
            number = self.count
        here = number == self.at or (self.lasting and number > self.at > 0)
        if here and self.kind in ERRORS:
            reason = getattr(errno, self.kind)
            raise OSError(reason, os.strerror(reason))
        if here and self.kind in KILLS:
            if self.kind == "torn" and torn is not None:
                torn()
            if self.kind == "after":
                with suppress(OSError):  # such as that of a folder that is there already
                    operation(*args, **options)
            os.kill(os.getpid(), signal.SIGKILL)
        return operation(*args, **options)


class _File:
    """An open file of the results, whose writing is an operation."""

    def __init__(self, file: Any, fault: Fault) -> None:
        self._file, self._fault = file, fault

    def __getattr__(self, name: str) -> Any:
        method = getattr(self._file, name)
        if name not in METHODS:
            return method

        def operation(*args: Any) -> Any:
            def torn() -> None:
                if name == "write":
                    method(args[0][: len(args[0]) // 2])
                    self._file.flush()

            return self._fault(method, *args, torn=torn)

        return operation

    def __enter__(self) -> _File:
        return self

    def __exit__(self, *args: Any) -> None:
        self._file.close()


def inject(fault: Fault, folder: Path) -> None:
    """Wrap the file operations of this process; those on files in `folder` count, and on open files."""
    inside = os.path.abspath(folder)

    def concerns(target: Any) -> bool:
        if isinstance(target, int):  # a file or a folder, and no pipe of the workers
            return stat.S_ISREG(mode := os.fstat(target).st_mode) or stat.S_ISDIR(mode)
        return os.path.abspath(os.fspath(target)).startswith(inside)

    def wrapped(function: Callable[..., Any]) -> Callable[..., Any]:
        def operation(target: Any, *args: Any, **options: Any) -> Any:
            if not concerns(target) or target in (1, 2):
                return function(target, *args, **options)
            return fault(function, target, *args, **options)

        return operation

    for name in FUNCTIONS:
        setattr(os, name, wrapped(getattr(os, name)))
    real = io.open

    def open_file(target: Any, mode: str = "r", *args: Any, **options: Any) -> Any:
        if not concerns(target) or (isinstance(target, str | os.PathLike) and not set(mode) & set("wxa+")):
            return real(target, mode, *args, **options)
        file = real(target, mode, *args, **options) if isinstance(target, int) else fault(real, target, mode, *args, **options)
        return _File(file, fault)

    io.open = open_file


@dataclass(frozen=True)
class Ended:
    """How a run ended: exit code (negative: the signal), what it printed, and the number of its file operations."""

    code: int
    output: str
    operations: int


class Forked:
    """A run of the command `doo3d detect` in a forked process.

    arguments: those of the command. out: the folder of the results. log: file for what is printed.
    """

    def __init__(self, arguments: list[str], out: Path, log: Path, fault: Fault | None = None) -> None:
        self._log, self._count = log, log.with_suffix(".count")
        self._count.write_text("0")
        sys.stdout.flush()
        sys.stderr.flush()
        self.process = os.fork()
        if self.process:
            return
        try:
            os.setsid()
            file = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
            os.dup2(file, 1)
            os.dup2(file, 2)
            code = _detect(arguments, out, fault or Fault(), self._count)
        except BaseException as error:
            os.write(2, f"Traceback: {error!r}".encode())
            code = 70
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)

    def wait(self) -> Ended:
        """Wait for the end of the run."""
        _, status = os.waitpid(self.process, 0)
        output = self._log.read_text(errors="replace") if self._log.exists() else ""
        return Ended(os.waitstatus_to_exitcode(status), output, int(self._count.read_text()))


def _detect(arguments: list[str], out: Path, fault: Fault, count: Path) -> int:
    from doo3d.cli import main

    sys.argv = ["doo3d", "detect", *arguments]
    number = os.open(count, os.O_WRONLY)
    write = os.write
    inject(fault, out)
    try:
        main()
    except SystemExit as ended:
        write(number, str(fault.count).encode())
        return int(ended.code or 0)
    return 0

"""Lock a run's folder, so that two runs never write into one folder at the same time."""

from __future__ import annotations

import contextlib
import errno
import json
import os
import socket
import sys
import time
from dataclasses import dataclass
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

from ..errors import InputError
from .atomic import PREFIX

LOCK = f"{PREFIX}run.lock"
"""Name of the lock file. It starts like those of temporary files, so that a folder with only the lock counts as empty."""

MAX_SILENCE_SECONDS = 300.0
"""Time in s after its last frame for which a run on another computer counts as alive, if the file system does not share locks
between computers: five times the default time limit of a frame."""

_TOUCH_SECONDS = 10.0  # between two updates of the lock file's time, by which other computers see that the run is alive
_ATTEMPTS = 20  # the folder or the lock file may be removed by another run that ends at this moment
_WINDOWS_BYTE = 1 << 20  # locked on Windows, far beyond the content, which others may then read
_UNSUPPORTED = {errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP, errno.EINVAL}  # a file system without locks


@dataclass(frozen=True)
class LockHolder:
    """The process that holds a lock, or held it when it was killed.

    Attributes
    ----------
    process
        its process id.
    host
        the name of its computer.
    started
        the time at which it took the lock, ISO 8601 in UTC; empty if unknown.
    """

    process: int
    host: str
    started: str = ""

    @staticmethod
    def this() -> LockHolder:
        """Return the holder that stands for this process."""
        return LockHolder(os.getpid(), socket.gethostname(), datetime.now(timezone.utc).isoformat(timespec="seconds"))

    @staticmethod
    def parse(content: bytes) -> LockHolder | None:
        """Return the holder written in a lock file; None if its content is something else, such as an incomplete line."""
        try:
            values: Any = json.loads(content)
            return LockHolder(int(values["process"]), str(values["host"]), str(values.get("started", "")))
        except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
            return None

    def __str__(self) -> str:
        return f"process {self.process} on {self.host}" + (f", since {self.started}" if self.started else "")


class RunLock:
    """An exclusive lock of a folder, held from creation to `release`.

    The lock is one of the operating system, on a file in the folder: it ends with the process, also after a kill. The file names
    process and host of the holder, for the error message of other runs. The file of a killed process is taken over.

    Parameters
    ----------
    folder
        the folder to lock; made if missing.

    Attributes
    ----------
    former
        the killed process from which the lock was taken over; None if there was none.

    Raises
    ------
    InputError : another process holds the lock.
    OSError : the lock file cannot be written.
    """

    def __init__(self, folder: Path) -> None:
        self._path = folder / LOCK
        self._file = self._open(folder)
        self._touched = time.monotonic()
        try:
            content = os.pread(self._file, 4096, 0) if hasattr(os, "pread") else os.read(self._file, 4096)
            self.former = LockHolder.parse(content)
            self._refuse_if_alive_elsewhere()
            os.ftruncate(self._file, 0)
            os.lseek(self._file, 0, os.SEEK_SET)
            os.write(self._file, json.dumps(vars(LockHolder.this())).encode("utf-8") + b"\n")
        except BaseException:
            os.close(self._file)
            raise

    def touch(self) -> None:
        """Show other computers that this run is alive, after each frame; write at most every ten seconds."""
        if time.monotonic() - self._touched > _TOUCH_SECONDS:
            self._touched = time.monotonic()
            with contextlib.suppress(OSError):
                os.utime(self._path)

    def release(self) -> None:
        """Remove the lock file and end the lock. Further calls do nothing."""
        if self._file < 0:
            return
        file, self._file = self._file, -1
        if sys.platform == "win32":
            os.close(file)  # an open file cannot be removed there
        with contextlib.suppress(OSError):
            self._path.unlink()
        if sys.platform != "win32":
            os.close(file)

    def _open(self, folder: Path) -> int:
        """Open and lock the lock file, and check that it is still the one in the folder."""
        for attempt in range(_ATTEMPTS):
            try:
                folder.mkdir(parents=True, exist_ok=True)
                file = os.open(self._path, os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0), 0o666)
            except FileNotFoundError:
                if attempt == _ATTEMPTS - 1:
                    raise
                time.sleep(0.01)
                continue
            try:
                if not _lock(file):
                    raise InputError(
                        f"{folder}: another run writes there ({_holder(self._path)})",
                        code="out-in-use",
                        remedy="wait for it, or give another folder with -o",
                    )
                if _is_at(file, self._path):
                    return file
            except BaseException:
                os.close(file)
                raise
            os.close(file)  # removed by the run that ended a moment ago
        raise OSError(errno.EAGAIN, "the lock file is replaced again and again", str(self._path))

    def _refuse_if_alive_elsewhere(self) -> None:
        """Raise if a run on another computer seems to be alive, since some file systems do not share locks."""
        if self.former is None or self.former.host == socket.gethostname():
            return
        if time.time() - os.fstat(self._file).st_mtime < MAX_SILENCE_SECONDS:
            raise InputError(
                f"{self._path.parent}: another run writes there ({self.former}); if it was killed, remove {self._path}, or wait "
                f"{MAX_SILENCE_SECONDS / 60:.0f} minutes",
                code="out-in-use",
                remedy="wait for it, or give another folder with -o",
            )


def _holder(path: Path) -> str:
    try:
        holder = LockHolder.parse(path.read_bytes()[:4096])
    except OSError:
        holder = None
    return str(holder) if holder else "it has just begun"


def _is_at(file: int, path: Path) -> bool:
    """Return whether an open file is the same as the one at a path."""
    try:
        return os.path.samestat(os.fstat(file), os.stat(path))
    except OSError:
        return False


def _lock(file: int) -> bool:
    """Lock an open file without waiting; return False if another process has locked it, True without support of locks."""
    try:
        if sys.platform == "win32":
            import msvcrt

            os.lseek(file, _WINDOWS_BYTE, os.SEEK_SET)
            msvcrt.locking(file, msvcrt.LK_NBLCK, 1)
            os.lseek(file, 0, os.SEEK_SET)
        else:
            import fcntl

            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        return error.errno in _UNSUPPORTED
    return True

"""Write files atomically: a file is complete or absent, also after a kill."""

import contextlib
import os
import secrets
from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from ..errors import InputError

PREFIX = ".doo3d-"  # of the names of temporary files; a killed run may leave one behind

FLUSHED_AT_A_TIME = 16
"""Number of files that `flush_to_disk` flushes in parallel; each then takes 0.3 ms instead of 4 ms."""


def write_bytes(path: Path, data: bytes, flushed: bool = True) -> None:
    """Write a file so that it is either complete or not there, even if the process is killed.

    The data are written under a temporary name in the same folder, flushed to the disk, and renamed to `path`. An existing file
    is replaced. Without `flushed`, a power failure may leave an incomplete file; call `flush_to_disk` in the end.

    Raises
    ------
    OSError
        the disk is full or the folder may not be written to; an existing file at `path` is unchanged.
    """
    temporary = path.parent / f"{PREFIX}{os.getpid()}-{secrets.token_hex(4)}.tmp"
    try:
        with temporary.open("xb") as file:
            file.write(data)
            file.flush()
            if flushed:
                os.fsync(file.fileno())
        os.replace(temporary, path)
    except BaseException:
        with contextlib.suppress(OSError):
            temporary.unlink()
        raise


def flush_to_disk(paths: Iterable[Path]) -> None:
    """Flush the content of all existing files among `paths` to the disk.

    Many files are flushed in parallel, since a file system writes their data together.

    Raises
    ------
    OSError
        the disk is full or fails.
    """
    with ThreadPoolExecutor(FLUSHED_AT_A_TIME) as threads:
        for _ in threads.map(_flush, paths):
            pass


def _flush(path: Path) -> None:
    with contextlib.suppress(FileNotFoundError), path.open("r+b") as file:
        os.fsync(file.fileno())


def write_text(path: Path, text: str) -> None:
    """Write text in UTF-8 so that the file is either complete or not there; line ends are not translated.

    An existing file is replaced.

    Raises
    ------
    OSError
        the disk is full or the folder may not be written to; an existing file at `path` is unchanged.
    """
    write_bytes(path, text.encode("utf-8"))


@contextlib.contextmanager
def writing(where: object, hint: str = "") -> Iterator[None]:
    """Convert an OSError in a `with` block that writes files to an InputError.

    where : the file or folder, named in the error. hint : end of the error's sentence.
    """
    try:
        yield
    except OSError as error:
        message = f"{where}: cannot be written to ({error.strerror or error}){hint}"
        raise InputError(message, code="out-unwritable") from None

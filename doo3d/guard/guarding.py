"""Convert exceptions about untrusted data to errors of doo3d."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ..errors import DooError, InputError, exception_place, unread_code

_MAX_LETTERS = 300  # of another library's message
_LFS_POINTER = b"version https://git-lfs.github.com/spec/"  # left by `git clone` where Git LFS is missing


@contextmanager
def guarded(where: str | os.PathLike[str], kind: type[DooError] = InputError, code: str = "file-damaged") -> Iterator[None]:
    """Convert every exception in a `with` block that reads untrusted data to an error of doo3d.

    Errors of doo3d pass unchanged. The exception is kept as the cause of the error.

    Parameters
    ----------
    where
        the file, named in the error.
    kind
        type of the error.
    code
        code of the error if the content is the reason.
    """
    try:
        yield
    except DooError:
        raise
    except OSError as error:
        if error.errno is None:  # raised by a library about content, not by the system
            raise kind(f"{where}: is damaged or cut off ({first_line(error)})", code=code) from error
        raise kind(f"{where}: cannot be read ({error.strerror or error})", code=unread_code(error)) from error
    except MemoryError as error:
        raise kind(f"{where}: needs more memory than there is: is it damaged?", code="size-too-large") from error
    except Exception as error:
        reason = " ".join(exception_place(error).split())[:_MAX_LETTERS]
        raise kind(f"{where}: is damaged, or its content is not what its format prescribes ({reason})", code=code) from error


@contextmanager
def prefixed(where: str, path: Path | None = None) -> Iterator[None]:
    """Prefix the InputErrors of a `with` block with a place, except those that already name the file or folder `path`."""
    try:
        yield
    except InputError as error:
        raise error if path and str(path) in str(error) else InputError(f"{where}: {error}", code=error.code) from None


def first_line(error: BaseException) -> str:
    """Return the first line of an exception's message, or the name of its type if the message is empty."""
    return next(iter(str(error).strip().splitlines()), type(error).__name__)[:_MAX_LETTERS]


def check_regular(path: Path, where: str | None = None, kind: type[DooError] = InputError) -> None:
    """Raise `kind` if a path is a device or a pipe, which may be endless; `where` is its name in the error."""
    if path.exists() and not (path.is_file() or path.is_dir()):
        raise kind(f"{where or path}: is a device or a pipe, expected a file", code="file-unreadable")


def check_not_pointer(path: Path, head: bytes) -> None:
    """Raise InputError if a file is a Git LFS pointer; `head` : its first 40 bytes or more."""
    if head.startswith(_LFS_POINTER):
        sentence = "is a pointer of Git LFS and not the file itself: install Git LFS and run git lfs pull in the repository"
        raise InputError(f"{path}: {sentence}", code="file-lfs-pointer")


def read_head(path: Path, count: int) -> bytes:
    """Read the first `count` bytes of a file, or all if it is shorter; raise OSError if it cannot be read."""
    with path.open("rb") as file:
        return file.read(count)


def read_bytes(
    path: str | Path, max_bytes: int, where: str | None = None, kind: type[DooError] = InputError, code: str = "file-damaged"
) -> bytes:
    """Read a file, up to a greatest size.

    Parameters
    ----------
    path
        the file.
    max_bytes
        greatest size of the file, bytes.
    where
        name of the file in errors; None for its path.
    kind, code
        type of the errors, and the code of the errors that have no other.

    Raises
    ------
    DooError : of type `kind`: the file is missing, cannot be read, is a device or a pipe, or is larger.
    """
    name = str(path) if where is None else where
    with guarded(name, kind, code):
        file = Path(path)
        size = file.stat().st_size
        check_regular(file, name, kind)
        if size > max_bytes:
            raise kind(
                f"{name}: has {size} bytes, more than such a file can have ({max_bytes}): is it another file?",
                code="size-too-large",
            )
        return file.read_bytes()

"""Check names that were read from files before they become file names, so that none is a path."""

from pathlib import PurePosixPath, PureWindowsPath

from ..errors import InputError

_MAX_BYTES = 240  # of a name: file systems allow 255, with a suffix


def is_file_name(name: object) -> bool:
    """Return whether a value is a string that is a valid file name, and not a path, on every platform."""
    return (
        isinstance(name, str)
        and name not in ("", ".", "..")
        and PurePosixPath(name).name == name
        and PureWindowsPath(name).name == name
        and all(ord(letter) >= 32 for letter in name)
        and len(name.encode("utf-8", "surrogatepass")) <= _MAX_BYTES
    )


def check_file_name(name: object, where: str) -> str:
    """Return `name` if it is a valid file name; `where` is the file that contains it, named in the error.

    Raises
    ------
    InputError : the name is not a string, is empty, or leads to another folder.
    """
    if isinstance(name, str) and is_file_name(name):
        return name
    raise InputError(
        f"{where}: a frame is called {str(name)[:80]!r}, which cannot be the name of a file: rename the frame",
        code="frame-name-invalid",
    )

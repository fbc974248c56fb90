"""Errors of doo3d, each a sentence that the user can act on and a stable code."""

from __future__ import annotations

import importlib
import traceback
from collections.abc import Iterable
from pathlib import Path
from types import ModuleType

UNEXPECTED = "unexpected"
"""The code of any exception that is not a DooError: a fault in doo3d."""


class DooError(Exception):
    """Base of every error that doo3d raises on purpose.

    Attributes
    ----------
    code
        short and stable, lower case with hyphens, such as "mask-shape": names the cause, for scripts and tests. The sentence
        may be rewritten from version to version; the code stays.
    """

    def __init__(self, message: str, *, code: str) -> None:
        super().__init__(message)
        self.code = code

    def __reduce__(self) -> tuple[object, ...]:
        """Keep the code when the error crosses a process boundary."""
        return _rebuild, (type(self), str(self), self.code)


class InputError(DooError):
    """The data cannot be used: a file, an array, a unit. The message names the cause, its place and the remedy."""


class ConfigError(DooError):
    """The configuration cannot be used: an unknown key, a value out of bounds, a missing preset."""


class MissingDependency(DooError):
    """An optional package is needed and not installed. The message holds the pip line."""


def _rebuild(kind: type[DooError], message: str, code: str) -> DooError:
    return kind(message, code=code)


def describe_error(error: Exception) -> str:
    """Return one sentence about an exception; of one that is not a DooError its type, its line in doo3d and its message."""
    if isinstance(error, DooError):
        return str(error)
    calls = traceback.extract_tb(error.__traceback__)
    in_doo3d = [call for call in calls if "doo3d" in Path(call.filename).parts] or calls
    line = f"{Path(in_doo3d[-1].filename).name}:{in_doo3d[-1].lineno}" if in_doo3d else "?"
    return f"{type(error).__name__} at {line}: {error} (this is a fault in doo3d, please report it)"


def error_code(error: Exception) -> str:
    """Return the code of an exception; UNEXPECTED if it is not a DooError."""
    return error.code if isinstance(error, DooError) else UNEXPECTED


def unread_code(error: OSError) -> str:
    """Return the code for a file that the system cannot open: "file-missing" or "file-unreadable"."""
    return "file-missing" if isinstance(error, FileNotFoundError) else "file-unreadable"


def invalid_code(kinds: Iterable[str]) -> str:
    """Return the code for values that pydantic refuses, from the first of its types of errors."""
    first = next(iter(kinds), "")
    if first == "extra_forbidden":
        return "key-unknown"
    return "value-out-of-bounds" if first.startswith(("greater_than", "less_than")) else "value-invalid"


def require(module: str, extra: str | None = None) -> ModuleType:
    """Import `module` when it is first needed.

    Parameters
    ----------
    module
        dotted name of the module.
    extra
        the optional-dependency group of doo3d that installs it; None for a plain dependency.

    Raises
    ------
    MissingDependency : it is not installed; the message holds the pip line.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        package = f"'doo3d[{extra}]'" if extra else module.split(".")[0]
        raise MissingDependency(
            f"{module} cannot be imported ({error}): install it with: pip install {package}", code="missing-package"
        ) from error

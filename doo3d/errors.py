"""What can go wrong, each with a sentence that the user can act on."""

from __future__ import annotations

import importlib
from collections.abc import Iterable
from types import ModuleType


class DooError(Exception):
    """Base of every error that doo3d raises on purpose.

    Attributes
    ----------
    code : short and stable, lower case with hyphens, such as "mask-shape": names the cause, for scripts and tests. The
        sentence may be rewritten from version to version; the code stays.
    """

    def __init__(self, message: str, *, code: str) -> None:
        super().__init__(message)
        self.code = code

    def __reduce__(self) -> tuple[object, ...]:
        """Keep the code when the error crosses a process boundary."""
        return _rebuilt, (type(self), str(self), self.code)


class InputError(DooError):
    """The data cannot be used: a file, an array, a unit. The message says what, where and what to do."""


class ConfigError(DooError):
    """The configuration cannot be used: an unknown key, a value out of bounds, a preset that is not there."""


class MissingDependency(DooError):
    """An optional package is needed and not installed. The message holds the pip line."""


def _rebuilt(kind: type[DooError], message: str, code: str) -> DooError:
    return kind(message, code=code)


def unread_code(error: OSError) -> str:
    """The code for a file that the system does not let us read: it is not there, or cannot be opened."""
    return "file-missing" if isinstance(error, FileNotFoundError) else "file-unreadable"


def invalid_code(kinds: Iterable[str]) -> str:
    """The code for values that pydantic refuses, by the first of its kinds of errors."""
    first = next(iter(kinds), "")
    if first == "extra_forbidden":
        return "key-unknown"
    return "value-out-of-bounds" if first.startswith(("greater_than", "less_than")) else "value-invalid"


def require(module: str, extra: str | None = None) -> ModuleType:
    """Import `module` when it is first needed.

    Parameters
    ----------
    module : dotted name of the module.
    extra : the optional-dependency group of doo3d that installs it; None for a plain dependency.

    Raises
    ------
    MissingDependency : it is not installed; the message holds the pip line.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        what = f"'doo3d[{extra}]'" if extra else module.split(".")[0]
        raise MissingDependency(
            f"{module} cannot be imported ({error}): install it with: pip install {what}", code="missing-package"
        ) from error

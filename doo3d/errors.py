"""Errors of doo3d, each a sentence that the user can act on and a stable code."""

import importlib
import re
import traceback
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

_MAX_LETTERS = 1400  # of a message

_SWITCHES = (
    "force",
    "restart",
    "retry_failed",
    "fuse_views",
    "sequence",
    "instances",
)  # arguments of Python that are True or False

UNEXPECTED = "unexpected"
"""The code of any exception that is not a DooError: a fault in doo3d."""


class DooError(Exception):
    """Base class of every error that doo3d raises on purpose; its message is a sentence that the user can act on.

    Attributes
    ----------
    code
        short text that identifies the cause, for scripts and tests: lower case with hyphens, such as "mask-shape". The
        sentence may be rewritten from version to version; the code stays.
    remedy
        end of the sentence, in words of the shell, such as "give another folder with -o, or --force to write there". `str` has
        it in those of Python, "give another folder, or force=True to write there"; `in_shell` as it is.
    """

    def __init__(self, message: str, *, code: str, remedy: str = "") -> None:
        self._message = _shortened(message)
        self.code, self.remedy = code, remedy
        super().__init__(f"{self._message}: {_in_python(remedy)}" if remedy else self._message)

    @property
    def in_shell(self) -> str:
        """The sentence for the shell."""
        return f"{self._message}: {self.remedy}" if self.remedy else self._message

    def __reduce__(self) -> tuple[object, ...]:
        """Keep code and remedy when the error crosses a process boundary."""
        return _rebuild, (type(self), self._message, self.code, self.remedy)


def _shortened(message: str) -> str:
    """Return a message without the middle of what it quotes, if that makes it longer than a screen."""
    half = _MAX_LETTERS // 2
    return message if len(message) <= _MAX_LETTERS else f"{message[:half]} ... {message[-half:]}"


class InputError(DooError):
    """Error of data that cannot be used, such as a file, an array or a unit; the message names cause, place and remedy."""


class ArgumentError(InputError, TypeError):
    """Error of an argument of the wrong type, such as a path where data is expected; the message names the expected types."""


class UnknownFrame(InputError, IndexError):
    """Error of a number or name that no frame of a capture has; the message names the frames."""


class ConfigError(DooError):
    """Error of a configuration that cannot be used: an unknown key, a value out of bounds, a missing preset."""


class MissingDependency(DooError):
    """Error of an optional package that is needed and not installed; the message holds the pip command."""


class DooWarning(UserWarning):
    """Warning about a result that may not be what the user expects; the message names the reason and the remedy."""


def _rebuild(kind: type[DooError], message: str, code: str, remedy: str) -> DooError:
    return kind(message, code=code, remedy=remedy)


def describe_error(error: Exception) -> str:
    """Return one sentence about an exception, for the user.

    For a DooError that is its message. Any other exception is a fault in doo3d: the sentence has the exception's type, the file
    and line in doo3d where it was raised, and its message.
    """
    if isinstance(error, DooError):
        return str(error)
    return f"{exception_place(error)} (this is a fault in doo3d, please report it)"


def exception_place(error: Exception) -> str:
    """Return an exception's type, the file and line in doo3d where it was raised, and its message, on one line."""
    calls = traceback.extract_tb(error.__traceback__)
    in_doo3d = [call for call in calls if "doo3d" in Path(call.filename).parts] or calls
    line = f"{Path(in_doo3d[-1].filename).name}:{in_doo3d[-1].lineno}" if in_doo3d else "?"
    return f"{type(error).__name__} at {line}: {error}"


def error_code(error: Exception) -> str:
    """Return the code of a DooError, such as "mask-shape"; "unexpected" for any other exception."""
    return error.code if isinstance(error, DooError) else UNEXPECTED


def unread_code(error: OSError) -> str:
    """Return the error code for a file that could not be opened: "file-missing" if it does not exist, else "file-unreadable"."""
    return "file-missing" if isinstance(error, FileNotFoundError) else "file-unreadable"


def invalid_code(kinds: Iterable[str]) -> str:
    """Return the error code for values that pydantic refused: "key-unknown", "value-out-of-bounds" or "value-invalid".

    kinds : the types of pydantic's errors (`ValidationError.errors()[i]["type"]`), such as "extra_forbidden"; the first decides.
    """
    first = next(iter(kinds), "")
    if first == "extra_forbidden":
        return "key-unknown"
    return "value-out-of-bounds" if first.startswith(("greater_than", "less_than")) else "value-invalid"


def invalid_value(error: Any, where: str, keys: Iterable[str]) -> InputError:
    """Return the error for the first value that pydantic refused (`error` is its ValidationError).

    `where` is the beginning of the message, before the key; `keys` are listed if the key is unknown or missing.
    """
    first = error.errors()[0]
    known = f"; the keys are {', '.join(keys)}" if first["type"] in ("extra_forbidden", "missing") else ""
    key = ".".join(map(str, first["loc"]))
    return InputError(f"{where}{key}: {first['msg']}{known}", code=invalid_code([first["type"]]))


@contextmanager
def options_of_python() -> Iterator[None]:
    """Name options in the errors of the block as arguments of Python: `time_limit=5` for `--time-limit 5`, `force=True`."""
    try:
        yield
    except DooError as error:
        raise type(error)(_in_python(str(error)), code=error.code).with_traceback(error.__traceback__) from error.__cause__


def _in_python(sentence: str) -> str:
    """Return a sentence with the options of the shell as arguments of Python."""
    sentence = re.sub(r"(?<![\w-])-c (\w+)", r"config='\1'", sentence)
    sentence = re.sub(r"(?<![\w-])-o\b", "out", sentence.replace(" with -o", ""))
    sentence = re.sub(r"--(?:input-option|set) (?:'([^']*)'|(?=[\w.]+=))", r"\1", sentence)

    def argument(option: re.Match[str]) -> str:
        name, value = option[1].replace("-", "_"), option[2]
        return f"{name}{f'={value}' if value else '=True' if name in _SWITCHES else ''}"

    return re.sub(r"--([a-z][a-z-]*)(?: ([A-Z]{2,}\b|[\d.]+))?", argument, sentence)


def require(module: str, extra: str | None = None) -> ModuleType:
    """Import an optional module when it is first needed, and return it.

    Parameters
    ----------
    module
        dotted name of the module.
    extra
        name of the optional-dependency group of doo3d that installs the module, such as "cluster"; None for a module that is
        always installed with doo3d.

    Raises
    ------
    MissingDependency : the module cannot be imported; the message holds the pip command.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        package = f"'doo3d[{extra}]'" if extra else module.split(".")[0]
        raise MissingDependency(
            f"{module} cannot be imported ({error}): install it with: pip install {package}", code="missing-package"
        ) from error

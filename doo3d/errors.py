"""What can go wrong, each with a sentence that the user can act on."""

from __future__ import annotations

import importlib
from types import ModuleType


class DooError(Exception):
    """Base of every error that doo3d raises on purpose."""


class InputError(DooError):
    """The data cannot be used: a file, an array, a unit. The message says what, where and what to do."""


class ConfigError(DooError):
    """The configuration cannot be used: an unknown key, a value out of bounds, a preset that is not there."""


class MissingDependency(DooError):
    """An optional package is needed and not installed. The message holds the pip line."""


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
        raise MissingDependency(f"{module} cannot be imported ({error}): install it with: pip install {what}") from error

"""Finds the built module of the kernels, which is not beside their sources in a checkout."""

import sys
from hashlib import sha256
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

from ..errors import MissingDependency

NAME = f"{__package__}._native"
SOURCES = Path(__file__).with_name("src")


def load_native() -> None:
    """Import the native module, and check that it was built of the sources beside this file, if there are any.

    A program that is run in the checkout imports the package of the checkout, which hides the installed one: then the module is
    that of the installed distribution.

    Raises
    ------
    MissingDependency : no such module is installed, or one of other sources; the message holds the pip command.
    """
    if find_spec(NAME) is None:
        from importlib import metadata  # takes long to import

        installed = metadata.distributions(name="doo3d")
        sys.modules[__package__].__path__.extend(str(each.locate_file("doo3d/kernels")) for each in installed)
    try:
        native = import_module(NAME)
    except ImportError as error:
        what = "are not installed" if isinstance(error, ModuleNotFoundError) else f"cannot be loaded ({error})"
        raise _unusable(what, "kernels-missing") from error
    sources = b"".join(path.read_bytes() for path in sorted(SOURCES.rglob("*.*")))  # as `backend/docstrings.py` does
    if sources and sha256(sources).hexdigest() != native.__sources__:
        raise _unusable(f"were built of other sources, in {native.__file__}", "kernels-outdated")


def _unusable(what: str, code: str) -> MissingDependency:
    checkout = SOURCES.parents[2]
    place = str(checkout) if (checkout / "pyproject.toml").is_file() else "its checkout"
    return MissingDependency(
        f"the native kernels of doo3d {what} ({sys.executable or 'Python'}): run pip install . in {place}", code=code
    )

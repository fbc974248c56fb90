"""Finds the built module of the kernels, which is not beside their sources in a checkout."""

from __future__ import annotations

import re
import sys
from importlib import import_module
from importlib.machinery import ModuleSpec, PathFinder
from importlib.util import module_from_spec
from pathlib import Path
from types import ModuleType

from .. import __version__
from ..errors import MissingDependency

NAME = f"{__package__}._native"
STUB = Path(__file__).with_name("__init__.pyi")


def load_native() -> ModuleType:
    """Return the native module that was built of these sources.

    A program that is run in the checkout imports the package of the checkout, which hides the installed one: then the module is
    that of the installed distribution, if both are of the same version and declare the same functions.

    Raises
    ------
    MissingDependency : no such module is installed, or one of other sources; the message holds the pip command.
    """
    try:
        native = _imported()
    except ImportError as error:
        raise _unusable(f"cannot be loaded ({error})", "kernels-missing") from error
    declared = re.findall(r"^(?:class|def) (\w+)", _text(STUB), re.MULTILINE)
    if missing := [name for name in declared if not hasattr(native, name)]:
        del sys.modules[NAME]
        raise _unusable(f"were built of older sources, without {missing[0]}", "kernels-outdated")
    return native


def _imported() -> ModuleType:
    try:
        return import_module(NAME)
    except ModuleNotFoundError as error:
        if error.name != NAME:
            raise
    spec = _installed()
    assert spec.loader is not None
    native = sys.modules[NAME] = module_from_spec(spec)
    try:
        spec.loader.exec_module(native)
    except BaseException:
        del sys.modules[NAME]
        raise
    return native


def _installed() -> ModuleSpec:
    """Return where the module of the installed distribution is."""
    from importlib import metadata  # takes long to import

    for installed in metadata.distributions(name="doo3d"):
        folder = Path(str(installed.locate_file("doo3d/kernels")))
        spec = PathFinder.find_spec(NAME, [str(folder)])
        if spec is None:
            continue
        if installed.version != __version__:
            raise _unusable(f"are of version {installed.version} in {folder}, and this is {__version__}", "kernels-outdated")
        if _text(folder / STUB.name) not in ("", _text(STUB)):
            raise _unusable(f"were built of other sources than these, in {folder}", "kernels-outdated")
        return spec
    raise _unusable("are not installed", "kernels-missing")


def _text(stub: Path) -> str:
    """Return the declarations of the functions; "" where no file has them, as in a program packed without it."""
    return stub.read_text(encoding="utf-8") if stub.is_file() else ""


def _unusable(what: str, code: str) -> MissingDependency:
    sources = STUB.parents[2]
    place = str(sources) if (sources / "pyproject.toml").is_file() else "its checkout"
    return MissingDependency(
        f"the native kernels of doo3d {what} ({sys.executable or 'Python'}): run pip install . in {place}", code=code
    )

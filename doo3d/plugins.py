"""Registries of what can be extended: doo3d's own entries, those added at run time, and those of installed plug-ins.

A plug-in is a package of its own that names entry points in a group such as "doo3d.readers"; doo3d finds them when they are
needed.
"""

from __future__ import annotations

import importlib
import warnings
from collections.abc import Callable, Iterator, MutableMapping
from functools import cache, partial
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from .errors import ConfigError, DooError, DooWarning

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

READERS, SEGMENTERS, COSTS, EXPORTS = "doo3d.readers", "doo3d.segmenters", "doo3d.costs", "doo3d.exports"

T = TypeVar("T")
R = TypeVar("R")


class Registry(MutableMapping[str, T], Generic[T]):
    """Dictionary of name -> class or function, in which plug-ins take part.

    Names come in this order: the entries of doo3d, those added at run time, those of plug-ins by name. An entry may be text,
    "module:member", which is imported on first use. A plug-in cannot replace another entry: a warning says that it is ignored.

    Parameters
    ----------
    group
        name of the group of entry points, such as "doo3d.readers".
    own
        the entries of doo3d.
    package
        the package that the modules of `own` are relative to.
    fault_of
        returns what an entry lacks to be one of this registry, such as "is not callable"; None if it lacks nothing.
    """

    def __init__(
        self,
        group: str,
        own: dict[str, str | T],
        package: str = "",
        fault_of: Callable[[Any], str | None] = lambda entry: None if callable(entry) else "is not callable",
    ) -> None:
        self.group = group
        self._fault_of = fault_of
        self._left_out: set[str] = set()
        self._entries = dict(own)
        self._package = package
        self._built_in = frozenset(own)
        self._loaded: dict[str, T] = {}

    def is_built_in(self, name: str) -> bool:
        """Return whether an entry is doo3d's own."""
        return name in self._built_in

    def __getitem__(self, name: str) -> T:
        """Return the class or function of a name, imported on first use.

        Raises
        ------
        KeyError : no entry has this name.
        ConfigError : a plug-in has it, and cannot be imported or used.
        """
        entry = self._entries[name] if name in self._entries else self._plug_in(name)
        if not isinstance(entry, str):
            return entry
        module, _, member = entry.partition(":")
        loaded: T = getattr(importlib.import_module(f".{module}" if self._package else module, self._package), member)
        self._entries[name] = loaded
        return loaded

    def __setitem__(self, name: str, entry: T) -> None:
        fault = None if isinstance(entry, str) else self._fault_of(entry)
        if fault:
            raise ConfigError(f"{name} cannot be added to {self.group}: {entry!r} {fault}", code="plugin-broken")
        self._entries[name] = entry

    def __delitem__(self, name: str) -> None:
        del self._entries[name]

    def __iter__(self) -> Iterator[str]:
        return iter([*self._entries, *(name for name in self._plug_ins() if name not in self._entries)])

    def __len__(self) -> int:
        return len(list(iter(self)))

    def __contains__(self, name: object) -> bool:
        return name in self._entries or name in self._plug_ins()

    def _plug_ins(self) -> dict[str, EntryPoint]:
        found = _entry_points(self.group)
        for name in found.keys() & self._built_in:
            warnings.warn(
                f"{_described(found[name])} is ignored: doo3d has a {name} itself; the plug-in needs another name",
                DooWarning,
                stacklevel=2,
            )
        return found

    def _plug_in(self, name: str) -> T:
        if name not in self._loaded:
            entry_point = self._plug_ins()[name]
            try:
                loaded = entry_point.load()
            except Exception as error:  # any code may stand there
                raise _broken(entry_point, "cannot be imported", error) from error
            if fault := self._fault_of(loaded):
                raise ConfigError(f"{_described(entry_point)} {fault}: mend or uninstall it", code="plugin-broken")
            self._loaded[name] = loaded
        return self._loaded[name]

    def working(self) -> Iterator[tuple[str, T]]:
        """Yield the names and entries that can be used; a note names each plug-in that is left out."""
        for name in self:
            entry = self.attempt(name, partial(self.__getitem__, name))
            if entry is not None:
                yield name, entry

    def attempt(self, name: str, function: Callable[[], R]) -> R | None:
        """Return the value of a function of a plug-in among others; None, and a note, if the plug-in is broken.

        name : name of the plug-in. function : raises a ConfigError with the code "plugin-broken" if it is.
        """
        if name in self._left_out:
            return None
        try:
            return function()
        except ConfigError as error:
            if error.code != "plugin-broken":
                raise
            self._left_out.add(name)
            warnings.warn(f"{error}; it is left out", DooWarning, stacklevel=3)
            return None

    def call(self, name: str, function: Callable[..., R], *args: Any) -> R:
        """Call a function of an entry; a fault of a plug-in is reported as one of the plug-in.

        Parameters
        ----------
        name
            name of the entry.
        function
            the entry itself, or a method of it.
        *args
            the arguments.

        Raises
        ------
        ConfigError : the entry is that of a plug-in, and the call raised anything but a DooError.
        """
        if name in self._entries:
            return function(*args)
        try:
            return function(*args)
        except DooError:
            raise
        except Exception as error:
            raise _broken(self._plug_ins()[name], "failed", error) from error


DRAWING: Registry[Any] = Registry("doo3d.drawing", {})
"""How results draw themselves, "figure" and "html": `doo3d` registers the functions of `viz`."""

CUSTOM_COSTS: Registry[Callable[[Any, Any], Any]] = Registry(COSTS, {})
"""Costs of the user: functions of the positions (E, D) m, D = 3 (in 2-D: px, D = 2), and the outward unit tangents (E, D) of E
chain ends to (E, E), the cost of joining each pair. Only entries [i, j] with i < j are used. Weights: `merge.custom_costs`."""


@cache
def _entry_points(group: str) -> dict[str, EntryPoint]:
    """Return the entry points of a group by name, sorted; looked up once, since that reads the metadata of all packages."""
    from importlib.metadata import entry_points  # takes long to import

    return {item.name: item for item in sorted(entry_points(group=group), key=lambda item: item.name)}


def plugin_names(group: str) -> list[str]:
    """Return the names that installed plug-ins have in a group, such as SEGMENTERS, without importing them."""
    return list(_entry_points(group))


def _broken(entry_point: EntryPoint, what: str, error: Exception) -> ConfigError:
    sentence = f"{_described(entry_point)} {what} ({type(error).__name__}: {error}): mend or uninstall it"
    return ConfigError(sentence, code="plugin-broken")


def _described(entry_point: EntryPoint) -> str:
    package = entry_point.dist.name if entry_point.dist else "?"
    return f"plug-in {entry_point.name} ({entry_point.group}) of the package {package}"

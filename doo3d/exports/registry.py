"""The export formats by name; each is imported on first use."""

from __future__ import annotations

import importlib
from typing import Any

from pydantic import ValidationError

from ..errors import ConfigError, invalid_code
from .base import Export

FORMATS: dict[str, str | type[Export]] = {
    "mjcf": "mjcf:Mjcf",
    "urdf": "urdf:Urdf",
    "usd": "usd:Usd",
    "usd-physics": "usd_physics:UsdPhysics",
    "ply": "mesh:Ply",
    "glb": "mesh:Glb",
    "obj": "mesh:Obj",
    "npz": "npz:Npz",
    "csv": "table:Csv",
    "nodes": "nodes:Nodes",
    "ros2": "ros2:Ros2",
    "swc": "swc:Swc",
}


def export_class(name: str) -> type[Export]:
    """Return the class of an export format; calling the class with options gives the format to write with.

    The module of the format is imported on first use.

    Parameters
    ----------
    name
        name of the format, such as "mjcf": a key of FORMATS in this module.

    Raises
    ------
    ConfigError
        there is no format of this name.
    """
    if name not in FORMATS:
        raise ConfigError(f"no export format {name!r}: choose one of {', '.join(FORMATS)}", code="format-unknown")
    entry = FORMATS[name]
    if not isinstance(entry, str):
        return entry
    module, _, member = entry.partition(":")
    kind: type[Export] = getattr(importlib.import_module(f".{module}", __package__), member)
    return kind


def export_of(name: str, options: dict[str, Any]) -> Export:
    """Return an export format with its options set, ready to write.

    Parameters
    ----------
    name
        name of the format, such as "mjcf": a key of FORMATS in this module.
    options
        option name -> value; options not given keep their defaults.

    Raises
    ------
    ConfigError
        the format or an option does not exist, or a value is out of bounds.
    """
    kind = export_class(name)
    try:
        return kind(**options)
    except ValidationError as error:
        raise ConfigError(
            f"{name}: " + "; ".join(_sentence(kind, item) for item in error.errors()),
            code=invalid_code(item["type"] for item in error.errors()),
        ) from None


def _sentence(kind: type[Export], item: Any) -> str:
    key = ".".join(map(str, item["loc"]))
    if item["type"] == "extra_forbidden":
        return f"no option {key!r}; the options are: {', '.join(kind.model_fields) or 'none'}"
    return f"{key} = {item['input']!r}: {item['msg'].removeprefix('Value error, ')}" if key else str(item["msg"])

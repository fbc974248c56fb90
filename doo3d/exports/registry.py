"""The formats, by name; each is imported when it is first asked for."""

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
    """The class that writes the format `name`.

    Raises
    ------
    ConfigError : there is no such format.
    """
    if name not in FORMATS:
        raise ConfigError(f"no format {name!r} to export to: the formats are {', '.join(FORMATS)}", code="format-unknown")
    entry = FORMATS[name]
    if not isinstance(entry, str):
        return entry
    module, _, member = entry.partition(":")
    found: type[Export] = getattr(importlib.import_module(f".{module}", __package__), member)
    return found


def export_of(name: str, options: dict[str, Any]) -> Export:
    """The format `name` with its options.

    Raises
    ------
    ConfigError : there is no such format or option, or a value is out of bounds.
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
        return f"no option {key!r}; there are: {', '.join(kind.model_fields) or 'none'}"
    return f"{key} = {item['input']!r}: {item['msg'].removeprefix('Value error, ')}" if key else str(item["msg"])

"""Register the export formats by name; each is imported on first use."""

from typing import Any

from pydantic import ValidationError

from ..errors import ConfigError, invalid_code
from ..plugins import EXPORTS, Registry
from .base import Export

_FILE_PER = ("capture", "frame", "chain")


def _fault_of(entry: Any) -> str | None:
    """Return the reason why an entry is not a valid export format; None if it is valid."""
    if not (isinstance(entry, type) and issubclass(entry, Export)):
        return "is no class derived from doo3d.exports.Export"
    for name, kind in (("summary", str), ("suffixes", tuple), ("supports_2d", bool)):
        if not isinstance(getattr(entry, name, None), kind):
            return f"has no {name} of type {kind.__name__}"
    return None if entry.file_per in _FILE_PER else f"has a file_per that is none of {', '.join(_FILE_PER)}"


FORMATS: Registry[type[Export]] = Registry(
    EXPORTS,
    {
        "mjcf": "mjcf:Mjcf",
        "mjcf-motion": "mjcf_motion:MjcfMotion",
        "urdf": "urdf:Urdf",
        "usd": "usd:Usd",
        "usd-physics": "usd_physics:UsdPhysics",
        "usd-cable": "usd_cable:UsdCable",
        "ply": "mesh:Ply",
        "glb": "mesh:Glb",
        "obj": "mesh:Obj",
        "npz": "npz:Npz",
        "csv": "table:Csv",
        "nodes": "nodes:Nodes",
        "coco": "coco:Coco",
        "ros2": "ros2:Ros2",
        "swc": "swc:Swc",
        "graphml": "graphml:GraphMl",
    },
    __package__ or "",
    _fault_of,
)


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
        there is no format of this name, or its plug-in is broken.
    """
    if name not in FORMATS:
        raise ConfigError(f"no export format {name!r}: choose one of {', '.join(FORMATS)}", code="format-unknown")
    return FORMATS[name]


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

"""doo3d: deformable linear objects (cables, ropes, hoses, wires) as 3-D chains, from RGB-D frames and point clouds.

The public names load when they are first used, so that importing the package costs nothing.
"""

import importlib
from typing import TYPE_CHECKING, Any

from .plugins import DRAWING

if TYPE_CHECKING:
    from .camera.open_rig import open_rig
    from .config import Config, load_config
    from .errors import ArgumentError, ConfigError, DooError, InputError, MissingDependency
    from .exports import export
    from .exports.newton_rods import to_newton
    from .fusion.fuse import fuse
    from .inputs import open_capture
    from .runs.choice import detect
    from .runs.detect_capture import run
    from .tools.explain import explain
    from .track.detect_sequence import detect_sequence
    from .track.detector import Detector
    from .track.tracking import Tracker
    from .types import Camera, Chain, Cloud, Detection, Frame, Image
    from .viz import draw
    from .viz.report.write import report

__version__ = "0.2.0"

_NAMES = {
    "config": ("Config", "load_config"),
    "errors": ("ArgumentError", "ConfigError", "DooError", "InputError", "MissingDependency"),
    "exports": ("export",),
    "exports.newton_rods": ("to_newton",),
    "inputs": ("open_capture",),
    "tools.explain": ("explain",),
    "camera.open_rig": ("open_rig",),
    "runs.choice": ("detect",),
    "runs.detect_capture": ("run",),
    "track.detect_sequence": ("detect_sequence",),
    "track.detector": ("Detector",),
    "fusion.fuse": ("fuse",),
    "track.tracking": ("Tracker",),
    "types": ("Camera", "Chain", "Cloud", "Detection", "Frame", "Image"),
    "viz": ("draw",),
    "viz.report.write": ("report",),
}
_DRAWN = {"figure": "figure:figure", "html": "notebook:html_of", "instances": "instance_labels:instance_labels"}
DRAWING.update({name: f"{__name__}.viz.{place}" for name, place in _DRAWN.items()})

_MODULE_OF = {name: module for module, names in _NAMES.items() for name in names}

__all__ = [
    "ArgumentError",
    "Camera",
    "Chain",
    "Cloud",
    "Config",
    "ConfigError",
    "Detection",
    "Detector",
    "DooError",
    "Frame",
    "Image",
    "InputError",
    "MissingDependency",
    "Tracker",
    "detect",
    "detect_sequence",
    "draw",
    "explain",
    "export",
    "fuse",
    "load_config",
    "open_capture",
    "open_rig",
    "report",
    "run",
    "to_newton",
]


def __getattr__(name: str) -> Any:
    if name not in _MODULE_OF:
        raise AttributeError(f"module 'doo3d' has no attribute {name!r}")
    return getattr(importlib.import_module(f".{_MODULE_OF[name]}", __name__), name)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]

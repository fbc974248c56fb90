"""doo3d: deformable linear objects (cables, ropes, hoses, wires) as 3-D chains, from RGB-D frames and point clouds.

The public names load when they are first used, so that importing the package costs nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .config import Config, load_config
    from .errors import ArgumentError, ConfigError, DooError, InputError, MissingDependency
    from .exports import export
    from .inputs import open_capture
    from .inspection.explain import explain
    from .pipeline import detect
    from .rig.opening import open_rig
    from .runs.detect_capture import run
    from .sequence.detect_sequence import detect_sequence
    from .sequence.detector import Detector
    from .sequence.fusion import fuse
    from .sequence.tracking import Tracker
    from .types import Camera, Chain, Cloud, Detection, Frame, Image
    from .viz import draw
    from .viz.report.write import report

__version__ = "0.1.0"

_MODULE_OF = {
    "ArgumentError": "errors",
    "Camera": "types",
    "Chain": "types",
    "Cloud": "types",
    "Config": "config",
    "ConfigError": "errors",
    "Detection": "types",
    "Detector": "sequence.detector",
    "DooError": "errors",
    "Frame": "types",
    "Image": "types",
    "InputError": "errors",
    "MissingDependency": "errors",
    "Tracker": "sequence.tracking",
    "detect": "pipeline",
    "draw": "viz",
    "detect_sequence": "sequence.detect_sequence",
    "explain": "inspection.explain",
    "export": "exports",
    "fuse": "sequence.fusion",
    "load_config": "config",
    "open_capture": "inputs",
    "open_rig": "rig.opening",
    "report": "viz.report.write",
    "run": "runs.detect_capture",
}

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
]


def __getattr__(name: str) -> Any:
    if name not in _MODULE_OF:
        raise AttributeError(f"module 'doo3d' has no attribute {name!r}")
    return getattr(importlib.import_module(f".{_MODULE_OF[name]}", __name__), name)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]

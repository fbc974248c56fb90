"""doo3d: deformable one-dimensional objects as 3-D chains, from RGB-D frames and point clouds.

The public names, loaded when first used so that importing the package costs nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .config import Config, load_config
    from .errors import ConfigError, DooError, InputError, MissingDependency
    from .exports import export
    from .pipeline import detect
    from .types import Camera, Chain, Cloud, Detection, Frame, Image

__version__ = "0.1.0"

_HOME = {
    "Camera": "types",
    "Chain": "types",
    "Cloud": "types",
    "Config": "config",
    "ConfigError": "errors",
    "Detection": "types",
    "DooError": "errors",
    "Frame": "types",
    "Image": "types",
    "InputError": "errors",
    "MissingDependency": "errors",
    "detect": "pipeline",
    "export": "exports",
    "load_config": "config",
}

__all__ = [
    "Camera",
    "Chain",
    "Cloud",
    "Config",
    "ConfigError",
    "Detection",
    "DooError",
    "Frame",
    "Image",
    "InputError",
    "MissingDependency",
    "detect",
    "export",
    "load_config",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'doo3d' has no attribute {name!r}")
    return getattr(importlib.import_module(f".{_HOME[name]}", __name__), name)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]

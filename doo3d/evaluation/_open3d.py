"""Open3D, loaded when first needed."""

from __future__ import annotations

import contextlib
import ctypes
import importlib
import sys
from typing import Any

from ..errors import require


def open3d() -> Any:
    """The open3d module.

    On Linux it links to a libusb that a bare machine lacks; the one of libusb-package is loaded first where installed.

    Raises
    ------
    MissingDependency : open3d is not installed or cannot be loaded.
    """
    if sys.platform == "linux" and "open3d" not in sys.modules:
        with contextlib.suppress(ImportError, OSError):
            path = importlib.import_module("libusb_package").get_library_path()
            ctypes.CDLL(str(path), mode=ctypes.RTLD_GLOBAL)
    return require("open3d")

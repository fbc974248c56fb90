"""Open3D, imported when it is first needed, since the import takes a second."""

from __future__ import annotations

import contextlib
import ctypes
import importlib
import sys
from types import ModuleType

from ...errors import require


def open3d() -> ModuleType:
    """Import and return the open3d module.

    Its Linux libraries link to libusb, which a minimal system lacks: if the package libusb-package is installed, its copy is
    loaded first with global symbols.

    Raises
    ------
    MissingDependency : open3d, or a library that it links to, cannot be loaded.
    """
    if sys.platform == "linux" and "open3d" not in sys.modules:
        with contextlib.suppress(ImportError, OSError):
            path = importlib.import_module("libusb_package").get_library_path()
            ctypes.CDLL(str(path), mode=ctypes.RTLD_GLOBAL)
    return require("open3d")

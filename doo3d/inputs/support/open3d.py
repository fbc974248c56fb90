"""Open3D, imported when it is first needed: that takes a second."""

from __future__ import annotations

import contextlib
import ctypes
import importlib
import sys
from types import ModuleType

from ...errors import require


def open3d() -> ModuleType:
    """The open3d module.

    Its Linux libraries link to libusb, which a bare machine lacks: the one that the package libusb-package carries is
    loaded first, for all to see, where that is installed.

    Raises
    ------
    MissingDependency : open3d, or what it links to, cannot be loaded.
    """
    if sys.platform == "linux" and "open3d" not in sys.modules:
        with contextlib.suppress(ImportError, OSError):
            path = importlib.import_module("libusb_package").get_library_path()
            ctypes.CDLL(str(path), mode=ctypes.RTLD_GLOBAL)
    return require("open3d")

"""Import Open3D when it is first needed, since the import takes a second."""

import contextlib
import ctypes
import importlib
import sys
from types import ModuleType

from ...errors import require


def open3d() -> ModuleType:
    """Import the package Open3D at the first call and return its module.

    On Linux, Open3D's libraries link to libusb, which a minimal system lacks. If the package libusb-package is installed, the
    libusb in it is loaded before Open3D.

    Raises
    ------
    MissingDependency : open3d, or a library that it links to, cannot be loaded.
    """
    if sys.platform == "linux" and "open3d" not in sys.modules:
        with contextlib.suppress(ImportError, OSError):
            path = importlib.import_module("libusb_package").get_library_path()
            ctypes.CDLL(str(path), mode=ctypes.RTLD_GLOBAL)
    return require("open3d")

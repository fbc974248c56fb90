"""Results out: chains as other programs take them, one file per format.

To add a format, write a file with one class like `npz.Npz` and give it a line in `FORMATS`; a program of your own puts its
class there itself.
"""

from __future__ import annotations

from .base import Export
from .registry import FORMATS, export_class
from .writer import Exportable, default_path, export

__all__ = ["FORMATS", "Export", "Exportable", "default_path", "export", "export_class"]

"""Export chains in the formats of other programs, one file per format.

To add a format, write a file with one class like `npz.Npz` and a line in `FORMATS`; your own program can add its class to
`FORMATS` itself.
"""

from .base import Export
from .registry import FORMATS, export_class
from .writer import Exportable, default_path, export

__all__ = ["FORMATS", "Export", "Exportable", "default_path", "export", "export_class"]

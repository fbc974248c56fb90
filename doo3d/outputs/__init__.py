"""Results out: one file per format. To add one, write a function like `document.write` and give it a line in `FORMATS`."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from pathlib import Path

from ..types import Cloud, Detection, Frame, Image

__all__ = ["FORMATS", "SUFFIXES", "Writer", "writer"]

Writer = Callable[[Path, Detection, Frame | Cloud | Image], None]

FORMATS = {
    "json": "document:write",
    "overlay": "picture:write",
}
SUFFIXES = {"json": ".json", "overlay": ".png"}


def writer(name: str) -> Writer:
    """The function that writes one detection as format `name`: (path, detection, what it was made from) -> None."""
    module, _, member = FORMATS[name].partition(":")
    found: Writer = getattr(importlib.import_module(f".{module}", __name__), member)
    return found

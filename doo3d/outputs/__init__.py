"""Results out: one file per format. To add one, write a function like `document.encode` and give it a line in `FORMATS`."""

from __future__ import annotations

import importlib
from collections.abc import Callable

from ..types import Cloud, Detection, Frame, Image

__all__ = ["FORMATS", "SUFFIXES", "Encoder", "encoded", "encoder"]

Encoder = Callable[[Detection, Frame | Cloud | Image], bytes]

FORMATS = {
    "json": "detection_json:encode",
    "overlay": "picture:encode",
}
SUFFIXES = {"json": ".json", "overlay": ".png"}


def encoder(name: str) -> Encoder:
    """The function that gives the file of one detection in format `name`: (detection, what it was made from) -> bytes."""
    module, _, member = FORMATS[name].partition(":")
    found: Encoder = getattr(importlib.import_module(f".{module}", __name__), member)
    return found


def encoded(detection: Detection, data: Frame | Cloud | Image) -> dict[str, bytes]:
    """The files of one detection, suffix to content, in every format."""
    return {SUFFIXES[kind]: encoder(kind)(detection, data) for kind in FORMATS}

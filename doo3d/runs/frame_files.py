"""The files that a run writes for each frame: the detection as JSON, and its picture.

To add one, write a function like `detection_json.encode`, and give it a line here and its suffix one in `outputs.SUFFIXES`.
"""

from __future__ import annotations

from collections.abc import Callable

from ..outputs import SUFFIXES, detection_json
from ..types import Cloud, Detection, Frame, Image
from ..viz import png

Encoder = Callable[[Detection, Frame | Cloud | Image], bytes]

ENCODERS: dict[str, Encoder] = {"json": detection_json.encode, "overlay": png.encode}


def encode_frame(detection: Detection, data: Frame | Cloud | Image) -> dict[str, bytes]:
    """Return the files of one detection, suffix to content."""
    return {SUFFIXES[kind]: encode(detection, data) for kind, encode in ENCODERS.items()}

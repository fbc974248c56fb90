"""The files of each frame of a run: the detection as JSON, and its picture.

To add a file, write a function like `detection_json.encode`, and add a line to ENCODERS and its suffix to `outputs.SUFFIXES`.
"""

from __future__ import annotations

from collections.abc import Callable

from ..outputs import SUFFIXES, detection_json
from ..types import Cloud, Detection, Frame, Image
from ..viz import png

Encoder = Callable[[Detection, Frame | Cloud | Image], bytes]

ENCODERS: dict[str, Encoder] = {"json": detection_json.encode, "overlay": png.encode}
"""Kind of file (a key of SUFFIXES) -> its encoder."""


def encode_frame(detection: Detection, data: Frame | Cloud | Image) -> dict[str, bytes]:
    """Return the content of the files of one frame, its JSON result and its picture; nothing is written to disk.

    `data` is the input of the detection, which is the background of the picture.

    Returns
    -------
    File name suffix -> content of the file, such as {".json": b"...", ".png": b"..."}.
    """
    return {SUFFIXES[kind]: encode(detection, data) for kind, encode in ENCODERS.items()}


def encode_result(detection: Detection) -> dict[str, bytes]:
    """Return the content of the JSON result of one frame alone, as `encode_frame` does."""
    return {SUFFIXES["json"]: detection_json.encode(detection)}

"""Encode the files of each frame of a run: the detection as JSON, and its picture.

To add a file, write a function like `detection_json.encode`, and add a line to ENCODERS and its suffix to `outputs.SUFFIXES`.
"""

from collections.abc import Callable, Iterable

from ..outputs import PICTURES, SUFFIXES, detection_json
from ..types import Cloud, Detection, Frame, Image
from ..viz import encoding

Encoder = Callable[[Detection, Frame | Cloud | Image], bytes]

ENCODERS: dict[str, Encoder] = {
    "json": detection_json.encode,
    "jpg": encoding.encode_jpeg,
    "png": encoding.encode_png,
    "instances": encoding.encode_instances,
}
"""Kind of file (a key of SUFFIXES) -> its encoder."""


def encode_frame(
    detection: Detection, data: Frame | Cloud | Image, kinds: Iterable[str] = ("json", PICTURES[0])
) -> dict[str, bytes]:
    """Return the content of the files of one frame, such as its JSON result and its picture; nothing is written to disk.

    Parameters
    ----------
    detection
        the chains of the frame.
    data
        the input of the detection, which is the background of the picture.
    kinds
        the wanted files, keys of ENCODERS.

    Returns
    -------
    File name suffix -> content of the file, such as {".json": b"...", ".jpg": b"..."}.
    """
    return {SUFFIXES[kind]: ENCODERS[kind](detection, data) for kind in kinds}

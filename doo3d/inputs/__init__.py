"""Captures in: one file per format, found by what it holds and not by its name alone.

To add a format, write a file with one class like `FolderCapture` and give it a line in `FORMATS`; the order is the
order of asking. A program of your own puts its class there itself: `FORMATS["mine"] = MyCapture`.
"""

from __future__ import annotations

import importlib
from pathlib import Path

from ..errors import InputError
from .capture import Capture, CaptureFormat, FrameData, FrameRef
from .external_masks import MaskedCapture
from .formats.trajectory import PosedCapture
from .read_options import DEFAULT, ReadOptions
from .support.images import is_image

__all__ = ["FORMATS", "IMAGE_FORMATS", "Capture", "FrameData", "FrameRef", "ReadOptions", "format_class", "open_capture"]

FORMATS: dict[str, str | CaptureFormat] = {
    "bag": "bag.reader:BagCapture",
    "tum": "formats.tum:TumCapture",
    "bop": "formats.bop:BopCapture",
    "icl": "formats.redwood:IclCapture",
    "redwood": "formats.redwood:RedwoodCapture",
    "record3d": "formats.record3d:Record3DCapture",
    "arrays": "formats.npz:ArraysCapture",
    "folder": "formats.open3d_folder:FolderCapture",
    "pairs": "formats.depth_yaml:PairsCapture",
    "cloud": "formats.cloud:CloudCapture",
    "photos": "formats.photos:PhotosCapture",
    "video": "formats.video:VideoCapture",
}
IMAGE_FORMATS = ("photos", "video")  # those that give images without depth, for the 2-D mode


def format_class(name: str) -> CaptureFormat:
    """The class that reads the format `name`, imported when first asked for."""
    entry = FORMATS[name]
    if not isinstance(entry, str):
        return entry
    module, _, member = entry.partition(":")
    found: CaptureFormat = getattr(importlib.import_module(f".{module}", __name__), member)
    return found


def open_capture(
    path: str | Path, images_only: bool = False, masks: str | Path | None = None, options: ReadOptions = DEFAULT
) -> Capture:
    """What is at `path`, as a sequence of frames that load when asked.

    Parameters
    ----------
    path : a folder or a file, in any of the formats of `FORMATS`.
    images_only : for the 2-D mode: of a folder with colour and depth the colour images alone.
    masks : instead of the capture's own: an image for a capture of one frame, or a folder of them.
    options : what the capture does not say itself, such as topics, intrinsics, a depth scale.

    Raises
    ------
    InputError : there is nothing, it is of no known format, or what all its frames need is missing or broken.
    """
    path = Path(path)
    try:
        if not path.exists():
            raise InputError(f"{path} does not exist", code="file-missing")
        for name in sorted(FORMATS, key=lambda name: images_only and name not in IMAGE_FORMATS):
            if (found := format_class(name)).can_read(path) or (name == "pairs" and _camera_is_said(path, options)):
                capture = found(path, options)
                if options.trajectory is not None:
                    capture = PosedCapture(capture, options.trajectory, options.tolerance)
                return MaskedCapture(capture, Path(masks)) if masks is not None else capture
        raise _unknown(path)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error})", code="file-unreadable") from None


def _camera_is_said(path: Path, options: ReadOptions) -> bool:
    """Whether `path` is an image of whose camera the user says enough to take it for depth."""
    return options.camera is not None and path.is_file() and is_image(path)


def _unknown(path: Path) -> InputError:
    known = f"What can be read: {'; '.join(format_class(name).what for name in FORMATS)}"
    if path.is_file():
        return InputError(
            f"{path}: this file is of no known format (a depth image alone is not enough, its camera has to be known). {known}",
            code="format-unknown",
        )
    inside = sorted(path.iterdir())
    if not inside:
        return InputError(f"{path}: this folder is empty. {known}", code="folder-empty")
    captures = [item.name for item in inside if any(format_class(name).can_read(item) for name in FORMATS)]
    if not captures:
        return InputError(f"{path}: this folder holds nothing of a known format. {known}", code="format-unknown")
    shown = ", ".join(captures[:5]) + (f" and {len(captures) - 5} more" if len(captures) > 5 else "")
    return InputError(
        f"{path}: this folder is not itself a capture but holds {len(captures)} of them, give one of these: {shown}",
        code="folder-of-captures",
    )

"""Masks from files outside the capture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from ..errors import InputError
from ..types import Cloud, Frame
from .capture import Capture, FrameData, FrameRef, extra_files_of, notes_of
from .support.images import PHOTO_SUFFIXES, read_mask
from .support.listing import images_in, match_images


class MaskedCapture:
    """A capture whose frames have masks from separate files instead of the capture's own.

    `masks` is one image, for a capture of one frame, or a folder of images. An image in the folder belongs to the frame whose
    name is the image's file name without the suffix; if no name agrees and there are as many images as frames, the first image
    belongs to the first frame and so on. Pixels above zero are the object. Loading a frame that has no mask file raises
    InputError.

    Raises
    ------
    InputError : `masks` does not exist, the folder has no mask for any frame, or one image is given for several frames.
    """

    def __init__(self, capture: Capture, masks: Path) -> None:
        self.path, self.format, self.masks = capture.path, capture.format, masks
        self.notes, self.extra_files = notes_of(capture), extra_files_of(capture)
        if masks.is_dir():
            names = {frame.name: frame for frame in capture.frames}
            files = match_images(images_in(masks, PHOTO_SUFFIXES), names)
            if not files:
                raise InputError(
                    f"{masks}: holds no mask for any of the {len(names)} frames of {capture.path}: name masks like frames",
                    code="mask-missing",
                )
        else:
            files = {_single_frame(capture, masks).name: masks}
        self.frames: Sequence[FrameRef] = [
            replace(frame, loader=partial(_load, frame, files.get(frame.name), masks)) for frame in capture.frames
        ]


def _single_frame(capture: Capture, masks: Path) -> FrameRef:
    if not masks.exists():
        raise InputError(f"{masks} does not exist", code="file-missing")
    if len(capture.frames) != 1:
        raise InputError(
            f"{masks}: is one mask, but {capture.path} has {len(capture.frames)} frames: give a folder of masks",
            code="frame-count",
        )
    return capture.frames[0]


def _load(frame: FrameRef, file: Path | None, masks: Path) -> FrameData:
    if file is None:
        raise InputError(f"{masks}: there is no mask for frame {frame.name}", code="mask-missing")
    loaded = frame.load()
    data = loaded.data
    if isinstance(data, Cloud):
        raise InputError(f"{file}: a mask needs an image, but {frame.source} is a cloud", code="mask-on-cloud")
    if isinstance(data, Frame):
        return replace(loaded, mask=read_mask(file, data.depth.shape))
    return replace(loaded, mask=read_mask(file, data.color.shape[:2], upright=True))

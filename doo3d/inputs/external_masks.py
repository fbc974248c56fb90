"""Masks from elsewhere than the capture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from ..errors import InputError
from ..types import Cloud, Frame
from .capture import Capture, FrameData, FrameRef
from .support.images import PHOTO_SUFFIXES, read_mask
from .support.listing import images_in, paired


class MaskedCapture:
    """A capture with the masks of another place instead of its own.

    masks : an image, for a capture of one frame; or a folder of images, which belong to the frames of the same name, or by
    order where no name fits and there are equally many.
    """

    def __init__(self, capture: Capture, masks: Path) -> None:
        self.path, self.format, self.masks = capture.path, capture.format, masks
        if masks.is_dir():
            names = {entry.name: entry for entry in capture.frames}
            files = paired(images_in(masks, PHOTO_SUFFIXES), names)
            if not files:
                raise InputError(
                    f"{masks}: holds no mask for any of the {len(names)} frames of {capture.path}", code="mask-missing"
                )
        else:
            files = {_only(capture, masks).name: masks}
        self.frames: Sequence[FrameRef] = [
            replace(entry, loader=partial(_load, entry, files.get(entry.name), masks)) for entry in capture.frames
        ]


def _only(capture: Capture, masks: Path) -> FrameRef:
    if not masks.exists():
        raise InputError(f"{masks} does not exist", code="file-missing")
    if len(capture.frames) != 1:
        raise InputError(
            f"{masks}: one mask, but {capture.path} has {len(capture.frames)} frames: give a folder of masks", code="frame-count"
        )
    return capture.frames[0]


def _load(entry: FrameRef, file: Path | None, masks: Path) -> FrameData:
    if file is None:
        raise InputError(f"{masks}: there is no mask {entry.name}", code="mask-missing")
    shot = entry.load()
    data = shot.data
    if isinstance(data, Cloud):
        raise InputError(f"{file}: a cloud has no pixels that a mask could be of", code="mask-on-cloud")
    if isinstance(data, Frame):
        return replace(shot, mask=read_mask(file, data.depth.shape))
    return replace(shot, mask=read_mask(file, data.color.shape[:2], upright=True))

"""Lists of image files in folders, and matching of images to frames by name."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from pathlib import Path

from ...errors import InputError
from .images import SUFFIXES


def natural_key(name: str) -> list[tuple[int, str]]:
    """Return a key for sorting names in natural order, in which numbers count by value: img9 before img10."""
    return [(int(part), part) if part.isdecimal() else (-1, part) for part in re.split(r"(\d+)", name) if part]


def images_in(folder: Path, suffixes: Collection[str] = SUFFIXES) -> dict[str, Path]:
    """Return the images in a folder as a dict stem -> path, in natural order of the file names (9 before 10).

    Hidden files are left out and sub-folders are not searched. The dict is empty if the folder does not exist. `suffixes` are
    lower-case with the dot, such as ".png".

    Raises
    ------
    InputError : two images have the same stem.
    """
    images: dict[str, Path] = {}
    files = [file for file in folder.iterdir() if not file.name.startswith(".")] if folder.is_dir() else []
    for file in sorted(files, key=lambda file: natural_key(file.name)):
        if file.suffix.lower() in suffixes:
            if file.stem in images:
                raise InputError(
                    f"{folder}: two images are called {file.stem} ({images[file.stem].name}, {file.name}): remove one",
                    code="names-clash",
                )
            images[file.stem] = file
    return images


def match_images(images: dict[str, Path], names: Mapping[str, object]) -> dict[str, Path]:
    """Match images to frames and return them as a dict frame name -> path.

    An image belongs to the frame whose name is its stem; then `images` is returned as it is, with stems that match no frame. If
    no stem is a frame's name, images and frames are matched by order if there are equally many; else the dict is empty.

    Parameters
    ----------
    images
        stem -> path, in order.
    names
        mapping whose keys are the frames' names, in order; its values are ignored.
    """
    if images and not images.keys() & names.keys():
        if len(images) == len(names):
            return dict(zip(names, images.values(), strict=True))
        return {}
    return images


def with_file(error: InputError, file: Path) -> InputError:
    """Return an error with the path `file` before the message of `error`.

    The error is returned unchanged if its message already has a path in the folder above the file's folder (the capture).
    """
    text = str(error)
    return error if str(file.parent.parent) in text else InputError(f"{file}: {text}", code=error.code)

"""Image files in folders: listed in the order of their names, and brought together by them."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from pathlib import Path

from ...errors import InputError
from .images import SUFFIXES


def natural(name: str) -> list[tuple[int, str]]:
    """What to sort names by, so that 9 comes before 10."""
    return [(int(part), part) if part.isdecimal() else (-1, part) for part in re.split(r"(\d+)", name) if part]


def images_in(folder: Path, suffixes: Collection[str] = SUFFIXES) -> dict[str, Path]:
    """Stem -> file of the images in a folder, in natural order; none where there is no folder.

    Raises
    ------
    InputError : two images have one stem.
    """
    found: dict[str, Path] = {}
    files = [file for file in folder.iterdir() if not file.name.startswith(".")] if folder.is_dir() else []
    for file in sorted(files, key=lambda file: natural(file.name)):
        if file.suffix.lower() in suffixes:
            if file.stem in found:
                raise InputError(
                    f"{folder}: {file.stem} is there twice ({found[file.stem].name}, {file.name}): remove one",
                    code="names-clash",
                )
            found[file.stem] = file
    return found


def paired(images: dict[str, Path], names: Mapping[str, object]) -> dict[str, Path]:
    """The images by the names that they belong to: their stems; where none fits, by order if there are equally many."""
    if images and not images.keys() & names.keys():
        if len(images) == len(names):
            return dict(zip(names, images.values(), strict=True))
        return {}
    return images


def located(error: InputError, file: Path) -> InputError:
    """The error with the file's name, where it has none yet."""
    text = str(error)
    return error if str(file.parent.parent) in text else InputError(f"{file}: {text}", code=error.code)

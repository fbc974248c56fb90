"""The error for a path in no known format: what was found in it, and the line that makes it readable."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from ..errors import InputError
from .capture import CaptureFormat
from .support.images import PHOTO_SUFFIXES

_MAX_LISTED = 5  # captures or kinds of files that an error names
_MAX_LOOKED_AT = 2000  # files of a folder that are counted
_ARCHIVES = (".zip", ".tar", ".gz", ".tgz", ".7z", ".rar", ".bz2", ".xz", ".zst")
_ARRAYS = (".npy", ".npz", ".mat", ".h5", ".hdf5", ".pkl", ".pt", ".raw", ".bin", ".csv", ".txt", ".oni", ".klg", ".svo", ".json")
_SAVE = "numpy.savez('capture.npz', depth=depth, K=K)"
_LAYOUT = "name the depth images <frame>_depth.png (16 bits, millimetres) and the color images <frame>_color.png"


def unknown_format(path: Path, formats: Sequence[CaptureFormat]) -> InputError:
    """Return the error for a file or folder that none of the formats can read."""
    listed = f"Formats that can be read: {'; '.join(str(reader.what) for reader in formats if hasattr(reader, 'what'))}"
    if path.is_file():
        return InputError(f"{path}: the format of this file is unknown; {_remedy_of_file(path)}. {listed}", code="format-unknown")
    inside = sorted(path.iterdir())
    if not inside:
        return InputError(f"{path}: this folder is empty. {listed}", code="folder-empty")
    captures = [item.name for item in inside if any(_can_read(reader, item) for reader in formats)]
    if captures:
        more = len(captures) - _MAX_LISTED
        names = ", ".join(captures[:_MAX_LISTED]) + (f" and {more} more" if more > 0 else "")
        return InputError(
            f"{path}: this folder is not a capture but holds {len(captures)} captures, give one of these: {names}",
            code="folder-of-captures",
        )
    return InputError(
        f"{path}: holds nothing in a known format. Found: {_inventory(inside)}. {_remedy_of_folder(inside)}. {listed}",
        code="format-unknown",
    )


def _can_read(reader: CaptureFormat, path: Path) -> bool:
    try:
        return reader.can_read(path)
    except Exception:  # of a damaged file, or of a plug-in
        return False


def _inventory(inside: Sequence[Path]) -> str:
    """Return the numbers of files by suffix, such as "12 .png, 3 .json", and the names of folders."""
    files = Counter(item.suffix.lower() or "without suffix" for item in inside[:_MAX_LOOKED_AT] if not item.is_dir())
    folders = [f"{item.name}/" for item in inside if item.is_dir()]
    kinds = [f"{count} {suffix}" for suffix, count in files.most_common(_MAX_LISTED)]
    more = len(folders) - _MAX_LISTED
    return ", ".join([*kinds, *folders[:_MAX_LISTED], *([f"{more} more folders"] if more > 0 else [])])


def _remedy_of_file(path: Path) -> str:
    suffix = path.suffix.lower()
    if suffix in _ARCHIVES:
        return "unpack it and give the folder"
    if suffix in _ARRAYS:
        return f"load it in Python and save its depth in metres and the camera matrix with {_SAVE}"
    return "is it a capture?"


def _remedy_of_folder(inside: Sequence[Path]) -> str:
    suffixes = Counter(suffix for item in inside[:_MAX_LOOKED_AT] if not item.is_dir() and (suffix := item.suffix.lower()))
    if any(item.suffix.lower() in PHOTO_SUFFIXES for folder in inside if folder.is_dir() for item in _first_files(folder)):
        return "To make it readable, call the sub-folders of the images depth and color"
    if not suffixes:
        return f"To make it readable, {_LAYOUT}, with a camera.json"
    common = next(iter(suffix for suffix, _ in suffixes.most_common() if suffix in (*_ARCHIVES, *_ARRAYS)), "")
    if common in _ARCHIVES:
        return "To make it readable, unpack the archives"
    if common:
        return f"To make it readable, load it in Python and save depth in metres and the camera matrix with {_SAVE}"
    return f"To make it readable, {_LAYOUT}, with a camera.json"


def _first_files(folder: Path) -> list[Path]:
    try:
        return sorted(folder.iterdir())[:_MAX_LISTED]
    except OSError:
        return []

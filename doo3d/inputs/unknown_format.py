"""Make the error for a path in no known format: its content, and a remedy."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from ..errors import InputError
from .capture import CaptureFormat
from .support.images import PHOTO_SUFFIXES

_MAX_LISTED = 5  # captures or kinds of files that an error names
_MAX_LOOKED_AT = 2000  # files of a folder that are counted
_ARCHIVES = (".zip", ".tar", ".gz", ".tgz", ".7z", ".rar", ".bz2", ".xz", ".zst")
_ARRAYS = (".npz", ".mat", ".h5", ".hdf5", ".pkl", ".pt", ".bin", ".oni", ".klg", ".svo", ".json")
_REMEDIES = {
    ".npy": "an array is read as depth (H, W), or as points (N, 3) of floats",
    ".raw": "the depth of a snapshot of RealSense's Viewer needs its <name>_metadata.csv beside it",
    **dict.fromkeys((".csv", ".txt", ".asc"), "a cloud has rows of numbers, x y z first or named in a line above, in metres"),
    **dict.fromkeys((".glb", ".gltf", ".fbx", ".dae", ".3mf"), "save the mesh as PLY, OBJ or STL, in metres"),
}
_SAVE = "numpy.savez('capture.npz', depth=depth, K=K)"
_LAYOUT = "name the depth images <frame>_depth.png (16 bits, millimetres) and the color images <frame>_color.png"


def unknown_format(path: Path, formats: Sequence[CaptureFormat]) -> InputError:
    """Return the error for a file or folder that none of the formats can read."""
    listed = "doo3d info --formats lists what can be read"
    if path.is_file():
        remedy = _remedy_of([path.suffix.lower()]) or "is it a capture?"
        return InputError(f"{path}: the format of this file is unknown: {remedy}; {listed}", code="format-unknown")
    inside = sorted(path.iterdir())
    if not inside:
        return InputError(f"{path}: this folder is empty; {listed}", code="folder-empty")
    if captures := [item.name for item in inside if any(_can_read(reader, item) for reader in formats)]:
        more = f" and {len(captures) - _MAX_LISTED} more" if len(captures) > _MAX_LISTED else ""
        sentence = f"this folder is not a capture but holds {len(captures)} captures, give one of these"
        return InputError(f"{path}: {sentence}: {', '.join(captures[:_MAX_LISTED])}{more}", code="folder-of-captures")
    found = f"holds nothing in a known format. Found: {_inventory(inside)}. To make it readable, {_remedy_of_folder(inside)}"
    return InputError(f"{path}: {found}; {listed}", code="format-unknown")


def _can_read(reader: CaptureFormat, path: Path) -> bool:
    try:
        return reader.can_read(path)
    except Exception:  # of a damaged file, or of a plug-in
        return False


def _inventory(inside: Sequence[Path]) -> str:
    """Return the numbers of files by suffix, such as "12 .png, 3 .json", and the names of folders."""
    files = Counter(item.suffix.lower() or "without suffix" for item in inside[:_MAX_LOOKED_AT] if not item.is_dir())
    folders, kinds = [f"{item.name}/" for item in inside if item.is_dir()], files.most_common(_MAX_LISTED)
    more = [f"{len(folders) - _MAX_LISTED} more folders"] if len(folders) > _MAX_LISTED else []
    return ", ".join([*(f"{count} {suffix}" for suffix, count in kinds), *folders[:_MAX_LISTED], *more])


def _remedy_of(suffixes: Sequence[str]) -> str:
    """Return the remedy for the first suffix that has one; "" if none has."""
    first = next((suffix for suffix in suffixes if suffix in (*_ARCHIVES, *_ARRAYS, *_REMEDIES)), "")
    array = f"load it in Python and save its depth in metres and the camera matrix with {_SAVE}" if first else ""
    return "unpack it and give the folder" if first in _ARCHIVES else _REMEDIES.get(first, array)


def _remedy_of_folder(inside: Sequence[Path]) -> str:
    if any(item.name == "meta" and (item / "info.json").is_file() for item in inside):
        return (
            "if it is a LeRobot dataset, load its frames in Python with lerobot's LeRobotDataset, which turns the codes of depth "
            f"videos into metres, and save them with {_SAVE}"
        )
    if any(item.suffix.lower() in PHOTO_SUFFIXES for folder in inside if folder.is_dir() for item in _first_files(folder)):
        return "call the sub-folders of the images depth and color"
    suffixes = Counter(item.suffix.lower() for item in inside[:_MAX_LOOKED_AT] if not item.is_dir())
    return _remedy_of([suffix for suffix, _ in suffixes.most_common()]) or f"{_LAYOUT}, with a camera.json"


def _first_files(folder: Path) -> list[Path]:
    try:
        return sorted(folder.iterdir())[:_MAX_LISTED]
    except OSError:
        return []

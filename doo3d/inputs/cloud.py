"""One point cloud in a file: PLY and PCD through Open3D, XYZ and NPZ through numpy."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import ClassVar

import numpy as np

from ..errors import InputError
from ..types import Array, Cloud
from ._open3d import open3d
from ._quiet import listening
from .base import Entry, Shot
from .reading import DEFAULT, Reading

Arrays = tuple[Array, Array | None]
_HEAD = 4096  # bytes that are looked at to tell the format
_NUMBER = r"[-+]?(?:\d+\.?\d*(?:[eE][-+]?\d+)?|\.\d+(?:[eE][-+]?\d+)?|nan|inf)"
_ROW = re.compile(rf"\s*{_NUMBER}(?:[\s,;]+{_NUMBER}){{2,}}[\s,;]*", re.IGNORECASE)
_COMMENTS = ("#", "//")


class CloudCapture:
    """A capture of one cloud. Coordinates are metres, in whatever frame the file has; the viewpoint is not known."""

    what: ClassVar[str] = "one cloud file: PLY, PCD, XYZ (columns x y z, with r g b if six), NPZ (points, with colors)"
    format = "cloud"

    def __init__(self, path: Path, reading: Reading = DEFAULT) -> None:
        self.path = path
        self.frames = [Entry(path.stem, path, partial(_load, path))]

    @staticmethod
    def recognises(path: Path) -> bool:
        """Whether `path` is a file that starts as one of the four do, or failing that is called so."""
        return path.is_file() and _kind(path) is not None


def _kind(path: Path) -> str | None:
    with path.open("rb") as file:
        head = file.read(_HEAD)
    if re.match(rb"ply\s", head):
        return "ply"
    stated = next((line for line in head.splitlines() if line.strip() and not line.lstrip().startswith(b"#")), b"")
    if head.startswith(b"# .PCD") or re.match(rb"(VERSION|FIELDS)\s", stated):
        return "pcd"
    if head.startswith(b"PK\x03\x04") and b".npy" in head:
        return "npz"
    lines = [line for line in head.decode("utf-8", "replace").splitlines() if line.strip()]
    rows = [line for line in lines if not line.lstrip().startswith(_COMMENTS)]
    if rows and _ROW.fullmatch(rows[0]):
        return "xyz"
    # the content is none of these: a name that says so gets the reason from the reader
    return path.suffix.lower()[1:] if path.suffix.lower() in (".ply", ".pcd", ".npz", ".xyz") else None


def _load(path: Path) -> Shot:
    try:
        if not path.stat().st_size:
            raise InputError(f"{path}: is empty")
        points, colors = _READERS[_kind(path) or ""](path)
        cloud = Cloud(points, _bytes(colors), name=path.stem)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error})") from None
    except InputError as error:
        raise error if str(path) in str(error) else InputError(f"{path}: {error}") from None
    if not len(cloud.points):
        raise InputError(f"{path}: holds no points with finite coordinates")
    return Shot(cloud)


def _bytes(colors: Array | None) -> Array | None:
    """Colours as uint8; those in floats are 0 to 1."""
    if colors is None or colors.dtype == np.uint8:
        return colors
    if not np.issubdtype(colors.dtype, np.floating) or not ((colors >= 0) & (colors <= 1)).all():
        raise InputError(f"colors are {colors.dtype}, expected uint8, or floats from 0 to 1")
    return np.asarray(np.rint(colors * 255), dtype=np.uint8)


def _read_open3d(path: Path, kind: str) -> Arrays:
    """Points and colours; what Open3D only warns about (and returns as noise or nothing) is an error."""
    reader = open3d().io
    with listening() as said:
        cloud = reader.read_point_cloud(str(path), format=kind)
    points, colors = np.asarray(cloud.points), np.asarray(cloud.colors)
    if said.text:
        if "<= 0" in said.text:
            raise InputError(f"{path}: holds no points")
        raise InputError(f"{path}: is cut off or damaged, or not a {kind.upper()} file ({_plain(said.text)})")
    if kind == "pcd":
        _check_ascii_pcd(path, len(points))
    return points, colors if len(colors) else None


def _check_ascii_pcd(path: Path, count: int) -> None:
    """Open3D fills up an ASCII PCD that ends too early with noise and says nothing: count the rows."""
    text = path.read_bytes()
    found = re.search(rb"^DATA\s+ascii\s*\n", text, re.MULTILINE)
    if not found:
        return
    rows = text[found.end() :].splitlines()
    widths = {len(row.split()) for row in rows} - {0}
    if len(rows) < count or len(widths) > 1:
        raise InputError(f"{path}: is cut off or damaged: {count} points are announced, {len(rows)} rows follow")


def _plain(text: str) -> str:
    """The first thing that was said, without colours and prefixes."""
    first = re.sub(r"\x1b\[[\d;]*m", "", text).splitlines()[0]
    return re.sub(r"^\[Open3D \w+\]\s*", "", first)


def _read_xyz(path: Path) -> Arrays:
    """Through numpy: Open3D passes over rows that it cannot read, trimesh runs ragged rows together."""
    with path.open(encoding="utf-8-sig", errors="replace") as file:
        text = file.read()
    first = next((line for line in text.splitlines() if line.strip() and not line.lstrip().startswith(_COMMENTS)), "")
    if not first:
        raise InputError(f"{path}: holds no points")
    for mark in ",;":
        if mark in first:
            text = text.replace(mark, " ")
    try:
        rows = np.loadtxt(text.splitlines(), comments=_COMMENTS, ndmin=2)
    except ValueError as error:
        raise InputError(f"{path}: is cut off or not XYZ (rows of equally many numbers, x y z first): {error}") from None
    if rows.shape[1] < 3:
        raise InputError(f"{path}: has {rows.shape[1]} columns, expected at least x y z")
    rest = rows[:, 3:6]
    has_colors = rows.shape[1] == 6 and bool(((rest >= 0) & (rest <= 255) & (rest == np.rint(rest))).all())
    return rows[:, :3], rest.astype(np.uint8) if has_colors else None


def _read_npz(path: Path) -> Arrays:
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as arrays:
            if "points" not in arrays:
                raise InputError(f"{path}: holds {', '.join(arrays) or 'nothing'}, expected points (N, 3) in metres")
            return arrays["points"], arrays["colors"] if "colors" in arrays else None
    except (ValueError, EOFError, zipfile.BadZipFile) as error:
        raise InputError(f"{path}: is cut off or not an NPZ of plain arrays ({error})") from None


_READERS: dict[str, Callable[[Path], Arrays]] = {
    "ply": partial(_read_open3d, kind="ply"),
    "pcd": partial(_read_open3d, kind="pcd"),
    "xyz": _read_xyz,
    "npz": _read_npz,
}

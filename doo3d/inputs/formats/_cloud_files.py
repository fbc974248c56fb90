"""Read cloud files: PLY and PCD with Open3D, NPZ and NPY with numpy."""

import math
import re
import zipfile
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...errors import InputError
from ...guard.guarding import guarded, read_head
from ...guard.limits import check_points, current_limits
from ...types import Array
from ..support.arrays import array_header, read_array, read_header
from ..support.native_output import capture_native_output
from ..support.open3d import open3d
from ._npz_arrays import MAX_ZIP_RATIO

MAX_CLOUD_HEADER_BYTES = 1 << 16  # of PLY and PCD
_MAX_LZF_RATIO = 100  # bytes that a byte of a compressed PCD unpacks to at most (LZF: 88)
HEAD_BYTES = 4096  # read to detect the format, and of a header
_NPY_COLUMNS = (3, 4, 6, 7)  # x y z, with intensity or r g b or both
_MAX_POINT_BYTES = 64  # of an array of points: three coordinates of 16 bytes


class Points(NamedTuple):
    """Points, colors and sensor position read from a cloud file, in the file's own coordinates.

    Attributes
    ----------
    points
        (N, 3) m, the coordinates of N points.
    colors
        (N, 3) RGB, uint8 or floats from 0 to 1; None if the file has none.
    viewpoint
        (3,) position of the sensor, m; None if unknown.
    notes
        a sentence for each assumption and conversion.
    """

    points: Array
    colors: Array | None = None
    viewpoint: Array | None = None
    notes: tuple[str, ...] = ()


def damaged(path: Path, reason: str) -> InputError:
    """Return the error for a file that is cut off, damaged, or in another format than its name or first bytes suggest."""
    return InputError(f"{path}: is cut off or damaged: {reason}", code="file-damaged")


def read_open3d(path: Path, kind: str) -> Points:
    """Read points, colors and viewpoint of a PLY or PCD file by Open3D.

    `kind` is "ply" or "pcd". Only a PCD file has a viewpoint, in its header; the header's default 0 0 0 1 0 0 0 counts as
    unknown.

    Raises
    ------
    InputError : the file has no points, or is damaged. MissingDependency : Open3D is not installed.
    """
    _check_announced(path, kind)
    reader = open3d().io
    with capture_native_output() as native:
        cloud = reader.read_point_cloud(str(path), format=kind)
    points, colors = np.asarray(cloud.points), np.asarray(cloud.colors)
    if native.text:
        if "<= 0" in native.text:
            raise InputError(f"{path}: holds no points", code="cloud-empty")
        raise damaged(path, _first_message(native.text))
    if kind == "pcd":
        _check_ascii_pcd(path, len(points))
    return Points(points, colors if len(colors) else None, _pcd_viewpoint(path) if kind == "pcd" else None)


def _check_announced(path: Path, kind: str) -> None:
    """Raise InputError if the header of a PLY or PCD announces more points than are allowed, or than the file can hold."""
    head = read_head(path, MAX_CLOUD_HEADER_BYTES)
    end = re.search(rb"^end_header|^DATA", head, re.MULTILINE)
    if end is None and kind == "pcd":  # Open3D reads on for it
        raise damaged(path, f"it has no line DATA within {MAX_CLOUD_HEADER_BYTES} bytes")
    head = head[: end.end()] if end else head

    def numbers(name: bytes) -> list[int]:
        return [int(number) for number in re.findall(rb"^" + name + rb"\s+(\d{1,30})", head, re.MULTILINE)]

    least, announced = 1, max(numbers(rb"element\s+vertex"), default=0)
    if kind == "pcd":
        least, sizes = _MAX_LZF_RATIO, numbers(b"(?:WIDTH|HEIGHT)")[:2]
        announced = max([math.prod(sizes) if sizes else 0, *numbers(b"POINTS")])
    check_points(announced, str(path))
    if announced > least * path.stat().st_size:
        raise damaged(path, f"its header declares {announced} points, more than fit into the file")


def _check_ascii_pcd(path: Path, count: int) -> None:
    """Check the number of rows of an ASCII PCD; if rows are missing, Open3D silently adds random points."""
    text = path.read_bytes()
    match = re.search(rb"^DATA\s+ascii\s*\n", text, re.MULTILINE)
    if not match:
        return
    rows = text[match.end() :].splitlines()
    widths = {len(row.split()) for row in rows} - {0}
    if len(rows) < count or len(widths) > 1:
        raise damaged(path, f"its header declares {count} points, it holds {len(rows)} rows")


def _pcd_viewpoint(path: Path) -> Array | None:
    """Return the sensor's position (3,) m from the header's VIEWPOINT (tx ty tz qw qx qy qz).

    Returns None if there is none, or the default 0 0 0 1 0 0 0, which writers use for an unknown viewpoint.
    """
    match = re.search(rb"^VIEWPOINT[ \t]+(.*)$", read_head(path, HEAD_BYTES).partition(b"\nDATA")[0], re.MULTILINE)
    if match is None:
        return None
    try:
        values = np.array(match[1].split(), dtype=float)
    except ValueError:
        values = np.zeros(0)
    if values.shape != (7,) or not np.isfinite(values).all():
        given = match[1].decode("utf-8", "replace").strip()
        raise InputError(f"{path}: VIEWPOINT is {given!r}, expected tx ty tz qw qx qy qz", code="viewpoint-invalid")
    return None if (values == (0, 0, 0, 1, 0, 0, 0)).all() else values[:3]


def _first_message(text: str) -> str:
    """Return the first line of Open3D's messages, without terminal color codes and prefix."""
    first = re.sub(r"\x1b\[[\d;]*m", "", text).splitlines()[0]
    return re.sub(r"^\[Open3D \w+\]\s*", "", first)


def read_npz(path: Path) -> Points:
    """Read a cloud of N points from an NPZ file with the array `points`, (N, 3) m, and optionally `colors`, (N, 3) RGB.

    Raises
    ------
    InputError : the file is damaged, or has no array `points`.
    """
    with guarded(path), path.open("rb") as file, np.load(file, allow_pickle=False) as arrays:
        if "points" not in arrays:
            sentence = f"{path}: holds {', '.join(arrays) or 'nothing'}, expected points (N, 3) in metres"
            raise InputError(sentence, code="points-missing")
        names = [name for name in ("points", "colors") if name in arrays]
        _check_arrays(path, names)
        return Points(*(arrays[name] for name in names))


def is_npy_cloud(path: Path) -> bool:
    """Return whether a .npy file is an array of points: floats (N, C) or (H, W, C), C from 3 to 7, x y z first."""
    try:
        shape, _, dtype = array_header(path)
    except (ValueError, EOFError, OSError):
        return False
    return dtype.kind == "f" and len(shape) in (2, 3) and shape[-1] in _NPY_COLUMNS


def read_npy(path: Path) -> Points:
    """Read a cloud from a .npy file of floats, x y z in m, with colors from 0 to 1 or to 255 in the last three of six columns.

    Raises
    ------
    InputError : the file is damaged or too large.
    """
    check_points(math.prod(array_header(path)[0][:-1]), str(path))
    array = read_array(path)
    cells = array.reshape(-1, array.shape[-1])
    cells = cells[np.isfinite(cells[:, :3]).all(axis=1)]
    return Points(cells[:, :3], colors_in(cells, True))


def colors_in(cells: Array, named: bool) -> Array | None:
    """Return the colors in the last three of six or seven columns, (N, 3) uint8, or floats from 0 to 1 if they are `named`."""
    rest = cells[:, -3:]
    if cells.shape[1] not in (6, 7) or not len(rest) or not (rest >= 0).all():
        return None
    if named and (rest <= 1).all():
        return rest
    return rest.astype(np.uint8) if ((rest <= 255) & (rest == np.rint(rest))).all() else None


def _check_arrays(path: Path, names: list[str]) -> None:
    """Raise InputError if arrays of an NPZ file announce more than the points that are allowed, or than the file can hold."""
    with zipfile.ZipFile(path) as archive:
        for name in names:
            with archive.open(f"{name}.npy") as file:
                shape, _, dtype = read_header(file)
            check_points(shape[0] if shape else 0, f"{path}: {name}")
            size = math.prod(shape) * dtype.itemsize
            if size > min(_MAX_POINT_BYTES * current_limits().max_points, MAX_ZIP_RATIO * path.stat().st_size):
                raise InputError(f"{path}: {name} has shape {shape}, too large for this file", code="array-too-large")

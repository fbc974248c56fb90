"""Readers of laser scans: LAS and LAZ through laspy, E57 through pye57."""

from __future__ import annotations

import struct
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from ...errors import InputError, require
from ...types import Array, Floats
from ._cloud_files import Points

_LAS_HEAD, _LAS_RECORD, _LAS_EXTENDED = 375, 54, 60  # bytes, of LAS 1.4's header and of the heads of records behind it
_CARTESIAN = ("cartesianX", "cartesianY", "cartesianZ")
_SPHERICAL = ("sphericalRange", "sphericalAzimuth", "sphericalElevation")
_COLORS = ("colorRed", "colorGreen", "colorBlue")


def read_las(path: Path) -> Points:
    """The points of a LAS or LAZ file, as float64 with its scale and offset: UTM coordinates stay what they are.

    Colours have 16 bits (LAS 1.4 R15, Point Data Record Format 2); where none is above 255, the writer left them at 8. All
    zero: there are none.
    """
    laspy = require("laspy", "las")
    require("lazrs", "las")
    if fault := _las_fault(path):
        raise InputError(f"{path}: is cut off or damaged: {fault}", code="file-damaged")
    try:
        with laspy.open(path) as file:
            announced, las = file.header.point_count, file.read()
        points = np.asarray(las.xyz, dtype=float)
    except OSError:
        raise
    except Exception as error:  # of laspy, of its decompressor, of numpy for half a record
        raise InputError(f"{path}: is cut off or damaged, or not a LAS file ({_first(error)})", code="file-damaged") from None
    if len(points) != announced:
        raise InputError(
            f"{path}: is cut off or damaged: {announced} points are announced, {len(points)} follow", code="file-damaged"
        )
    if "red" not in las.point_format.dimension_names:
        return Points(points)
    colors = np.column_stack([las.red, las.green, las.blue])
    if not colors.any():
        return Points(points)
    # v >> 8 takes back both ways of widening, v * 257 and v << 8
    return Points(points, (colors if colors.max() <= 255 else colors >> 8).astype(np.uint8))


def _las_fault(path: Path) -> str | None:
    """What its head announces that the file has no room for: laspy would go on reading beyond the end for hours."""
    size = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(_LAS_HEAD)
    header, points, records = struct.unpack_from("<HII", head.ljust(_LAS_HEAD, b"\0"), 94)
    if records * _LAS_RECORD > max(min(points, size) - header, 0):
        return f"{records} variable length records are announced, for which there is no room"
    if head[25:26] >= b"\x04" and len(head) == _LAS_HEAD:
        start, extended = struct.unpack_from("<QI", head, 235)
        if extended * _LAS_EXTENDED > max(size - start, 0):
            return f"{extended} extended variable length records are announced, for which there is no room"
    return None


def count_e57(path: Path) -> int:
    """How many scans an E57 file holds.

    Raises
    ------
    InputError : it cannot be read. MissingDependency : pye57 is not installed.
    """
    library = _e57()
    image = _open_e57(library, path)
    try:
        return len(image.root()["data3D"])
    except library.E57Exception as error:
        raise InputError(f"{path}: is cut off or damaged ({_first(error)})", code="file-damaged") from None
    finally:
        image.close()


def read_e57(path: Path, scan: int) -> Points:
    """One scan in the frame of the file, into which its pose puts it: x_file = R x_scanner + t (ASTM E2807).

    The viewpoint is t, where the scanner stood. A pose that is not there or the identity says nothing: merged clouds are
    written so; then the viewpoint is not known.
    """
    library = _e57()
    image = _open_e57(library, path)
    try:
        scans = image.root()["data3D"]
        if scan >= len(scans):
            raise InputError("the file does not hold so many", code="frame-unknown")
        node = scans[scan]
        points, colors = _e57_points(library, image, node)
        pose = _pose(node)
    except library.E57Exception as error:
        raise InputError(f"{path}: scan {scan} is cut off or damaged ({_first(error)})", code="file-damaged") from None
    except InputError as error:
        raise InputError(f"{path}: scan {scan}: {error}", code=error.code) from None
    finally:
        image.close()
    if pose is None:
        return Points(points, colors)
    rotation, translation = pose
    return Points(points @ rotation.T + translation, colors, translation)


def _e57() -> ModuleType:
    require("pye57", "e57")
    return require("pye57.libe57", "e57")


def _open_e57(library: ModuleType, path: Path) -> Any:
    try:
        return library.ImageFile(str(path), "r")
    except library.E57Exception as error:
        code = "file-damaged" if path.stat().st_size else "file-empty"
        raise InputError(f"{path}: is cut off or damaged, or not an E57 file ({_first(error)})", code=code) from None


def _e57_points(library: ModuleType, image: Any, node: Any) -> tuple[Floats, Array | None]:
    """(N, 3) m in the scanner's frame and (N, 3) uint8, of the points that are not marked invalid."""
    held = node["points"]
    prototype = library.StructureNode(held.prototype())
    axes = next((axes for axes in (_CARTESIAN, _SPHERICAL) if all(map(prototype.isDefined, axes))), None)
    if axes is None:
        raise InputError("the points have neither cartesian nor spherical coordinates", code="points-missing")
    invalid = "cartesianInvalidState" if axes is _CARTESIAN else "sphericalInvalidState"
    colored = all(map(prototype.isDefined, _COLORS))
    names = [*axes, *(_COLORS if colored else ()), *([invalid] if prototype.isDefined(invalid) else [])]
    count = held.childCount()
    values = {name: np.zeros(count) for name in names}
    buffers = library.VectorSourceDestBuffer()
    for name, array in values.items():
        buffers.append(library.SourceDestBuffer(image, name, array, count, True, True))
    read = held.reader(buffers).read() if count else 0
    if read != count:
        raise InputError(f"{count} points are announced, {read} follow", code="file-damaged")
    good = values[invalid] == 0 if invalid in values else np.ones(count, dtype=bool)
    first, second, third = (values[name][good] for name in axes)
    if axes is _SPHERICAL:  # range, azimuth from x towards y, elevation from the xy plane
        flat = first * np.cos(third)
        first, second, third = flat * np.cos(second), flat * np.sin(second), first * np.sin(third)
    points = np.column_stack((first, second, third))
    if not colored:
        return points, None
    colors = np.column_stack([values[name][good] for name in _COLORS])
    low, high = _color_limits(library, node, colors)
    return points, np.rint(255 * np.clip((colors - low) / (high - low), 0, 1)).astype(np.uint8)


def _color_limits(library: ModuleType, node: Any, colors: Floats) -> tuple[float, float]:
    """What is black and what is full colour: as the scan says, else the least of 8 bits and 16 that holds all."""
    if node.isDefined("colorLimits"):
        limits = node["colorLimits"]
        low, high = (float(limits[f"colorRed{end}"].value()) for end in ("Minimum", "Maximum"))
        if high > low:
            return low, high
    return 0.0, 255.0 if colors.max(initial=0) <= 255 else 65535.0


def _pose(node: Any) -> tuple[Floats, Floats] | None:
    """Scanner to file: (3, 3) from the unit quaternion, (3,) m. None where it is missing or the identity."""
    from scipy.spatial.transform import Rotation

    if not node.isDefined("pose"):
        return None
    pose, rotation, translation = node["pose"], np.array((1.0, 0.0, 0.0, 0.0)), np.zeros(3)
    if pose.isDefined("rotation"):
        rotation = np.array([float(pose["rotation"][name].value()) for name in "wxyz"])
    if pose.isDefined("translation"):
        translation = np.array([float(pose["translation"][name].value()) for name in "xyz"])
    if not (np.isfinite(rotation).all() and np.isfinite(translation).all() and np.linalg.norm(rotation) > 0):
        raise InputError(
            f"the pose is {rotation} {translation}, expected a unit quaternion w x y z and metres", code="pose-invalid"
        )
    matrix = Rotation.from_quat(rotation[[1, 2, 3, 0]]).as_matrix()
    return None if np.array_equal(matrix, np.eye(3)) and not translation.any() else (matrix, translation)


def _first(error: Exception) -> str:
    """The first line of what a library says."""
    return next(iter(str(error).strip().splitlines()), type(error).__name__)

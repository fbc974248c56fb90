"""Read laser scans: LAS and LAZ with laspy, E57 with pye57."""

import re
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from ...errors import InputError, require
from ...guard.guarding import first_line, prefixed, read_head
from ...guard.limits import check_points
from ...types import Array, Floats
from ..support.calibration import NUMBER
from ._cloud_files import Points, damaged

_LAS_HEADER_BYTES, _VLR_HEADER_BYTES, _EVLR_HEADER_BYTES = 375, 54, 60  # LAS 1.4: file header, record headers
_CARTESIAN = ("cartesianX", "cartesianY", "cartesianZ")
_SPHERICAL = ("sphericalRange", "sphericalAzimuth", "sphericalElevation")
_COLORS = ("colorRed", "colorGreen", "colorBlue")
_WIRES = (13, 14)  # LAS 1.4 R15, table 17: wire - guard (shield), wire - conductor (phase)
_WKT, _GEO_KEYS, _LINEAR_UNIT, _VERTICAL_UNIT = 2112, 34735, 3076, 4099  # record IDs of the CRS; keys of its units (GeoTIFF 1.0)
_FEET = {9002: ("foot", 0.3048), 9003: ("US survey foot", 1200 / 3937)}  # codes of units (EPSG) -> name, m
_METRE = ("metre", 1.0)
_UNIT = re.compile(rf'\b(?:LENGTH)?UNIT\["([^"]+)",\s*({NUMBER})')
_VERTICAL = re.compile(r"\bVERT(?:_CS|CRS)\[")
_UNIT_RANGE_M = (0.001, 1000.0)  # length of a unit; radians and degrees are recognized by their names


def read_las(path: Path, converted: bool = True, classes: tuple[int, ...] | None = None) -> Points:
    """Read the points (m) and colors of a LAS or LAZ file; the viewpoint is None.

    The unit that the file's coordinate system declares, such as feet, is converted to metres unless `converted` is False. If
    points have classes, only those in `classes` are kept; None keeps wires (13 and 14) if there are any, else all points.

    Coordinates are float64 with the file's scale and offset applied, so that UTM coordinates keep their precision. Colors are
    uint8: the file's 16-bit colors (LAS 1.4 R15, Point Data Record Format 2) are reduced to 8 bits, or taken as they are if no
    value is above 255. Colors that are all zero count as absent.

    Raises
    ------
    InputError : the file is damaged or no LAS file, or has no point of these classes.
    MissingDependency : laspy or lazrs is not installed.
    """
    laspy = require("laspy", "las")
    require("lazrs", "las")
    if fault := _las_fault(path):
        raise damaged(path, fault)
    try:
        with laspy.open(path) as file:
            declared = file.header.point_count
            check_points(declared, str(path))
            las = file.read()
        points = np.asarray(las.xyz, dtype=float)
    except (OSError, InputError, MemoryError):
        raise
    except Exception as error:  # from laspy, its decompressor, or numpy for half a record
        raise damaged(path, first_line(error)) from None
    if len(points) != declared:
        raise damaged(path, f"its header declares {declared} points, it holds {len(points)}")
    units, unit_notes = _declared_units(las) if converted else (None, [])
    points = points if units is None else points * units
    kept, class_notes = _kept_classes(np.asarray(las.classification), classes, path)
    points, notes = points[kept], (*unit_notes, *class_notes)
    has_colors = "red" in las.point_format.dimension_names
    colors: Array = np.column_stack([las.red, las.green, las.blue])[kept] if has_colors else np.zeros(0)
    if not colors.any():
        return Points(points, notes=notes)
    # v >> 8 inverts both conversions from 8 to 16 bits, v * 257 and v << 8
    return Points(points, (colors if colors.max() <= 255 else colors >> 8).astype(np.uint8), notes=notes)


def _kept_classes(found: Array, classes: tuple[int, ...] | None, path: Path) -> tuple[Array, list[str]]:
    """Return which points have one of the classes, (N,) bool, and a note if wires were chosen by default."""
    chosen = _WIRES if classes is None else classes
    kept = np.isin(found, chosen)
    if classes is not None and not kept.any():
        present = ", ".join(map(str, np.unique(found).tolist()))
        raise InputError(f"{path}: no point is of class {', '.join(map(str, classes))}, only of {present}", code="cloud-empty")
    if classes is not None or not kept.any() or kept.all():
        return (kept if kept.any() else np.ones(len(found), dtype=bool)), []
    named = " and ".join(str(each) for each in _WIRES if each in found)
    note = f"of {len(found)} points only the {np.count_nonzero(kept)} of class {named}, wires, are read"
    return kept, [f"{note}: for others give --input-option classification=[...]"]


def _declared_units(las: Any) -> tuple[Floats | None, list[str]]:
    """Return the declared units of x, y, z as lengths in m, (3,), with a note; None if all are metres."""
    records = {record.record_id: record for record in reversed([*las.vlrs, *(las.evlrs or ())])}
    if (wkt := records.get(_WKT)) is not None:
        text = getattr(wkt, "string", None) or wkt.record_data_bytes().decode("utf-8", "replace")
        found = [_last_unit(part) for part in _VERTICAL.split(text, maxsplit=1)]
    else:
        values = {key.id: key.value_offset for key in getattr(records.get(_GEO_KEYS), "geo_keys", ())}
        found = [_FEET.get(values[key], _METRE) for key in (_LINEAR_UNIT, _VERTICAL_UNIT) if key in values] or [_METRE]
    horizontal, vertical = found[0], found[-1]
    if horizontal[1] == vertical[1] == 1:
        return None, []
    names = " and ".join(dict.fromkeys(name for name, length in (horizontal, vertical) if length != 1))
    note = f"coordinates in units of {names}, as the file declares, are converted to metres"
    return np.array([horizontal[1], horizontal[1], vertical[1]]), [note]


def _last_unit(text: str) -> tuple[str, float]:
    """Return name and length (m) of the last unit of length in well-known text, the unit of the axes; default metre."""
    low, high = _UNIT_RANGE_M
    units = [(name, float(length)) for name, length in _UNIT.findall(text) if not name.lower().startswith(("deg", "rad"))]
    return next((unit for unit in reversed(units) if low <= unit[1] <= high), _METRE)


def _las_fault(path: Path) -> str:
    """Return the fault of a header that declares more records than the file can hold, else "".

    laspy would read such a file for hours.
    """
    size = path.stat().st_size
    header = read_head(path, _LAS_HEADER_BYTES).ljust(_LAS_HEADER_BYTES, b"\0")
    header_size, points_at, records, record_format, record_bytes, points = struct.unpack_from("<HIIBHI", header, 94)
    if header[25] >= 4:
        points = max(points, struct.unpack_from("<Q", header, 247)[0])
    held = max(size - points_at, 0)
    if not record_format & 0xC0 and points * record_bytes > held:  # not compressed
        return f"its header declares {points} points, it holds {held // record_bytes}"
    check_points(points, str(path))
    if records * _VLR_HEADER_BYTES > max(min(points_at, size) - header_size, 0):
        return f"its header declares {records} variable length records, more than fit into the file"
    start, extended = struct.unpack_from("<QI", header, 235) if header[25] >= 4 else (0, 0)
    if extended * _EVLR_HEADER_BYTES > max(size - start, 0):
        return f"its header declares {extended} extended variable length records, more than fit into the file"
    return ""


def count_e57(path: Path) -> int:
    """Return the number of scans in an E57 file, from its header.

    Raises
    ------
    InputError : the file cannot be read, or holds no scans. MissingDependency : pye57 is not installed.
    """
    with _opened(path) as (_, _, scans):
        return len(scans)


def read_e57(path: Path, scan: int) -> Points:
    """Read scan number `scan` (from 0) of an E57 file, in the coordinates of the file.

    The file stores points in the scanner's frame with the scanner's pose, a rotation R and a translation t in m; the points
    returned are x_file = R x_scanner + t (ASTM E2807), and the viewpoint is t, the scanner's position. If the pose is absent or
    the identity, as in merged clouds, the viewpoint is None. Points marked as invalid are left out. Coordinates in the file may
    be cartesian or spherical; colors are scaled to 8 bits.

    Raises
    ------
    InputError : the file holds no scans or no scan of this number, or the scan is damaged.
    MissingDependency : pye57 is not installed.
    """
    with _opened(path) as (library, image, scans):
        if scan >= len(scans):
            raise InputError(f"{path}: holds {len(scans)} scans only", code="frame-unknown")
        with prefixed(f"{path}: scan {scan}"):
            points, colors = _e57_points(library, image, scans[scan])
            pose = _pose(scans[scan])
    if pose is None:
        return Points(points, colors)
    rotation, translation = pose
    return Points(points @ rotation.T + translation, colors, translation)


@contextmanager
def _opened(path: Path) -> Iterator[tuple[ModuleType, Any, Any]]:
    """Yield pye57's library, the open file and its scans; errors of the library become InputErrors.

    The file stays open for further scans.
    """
    require("pye57", "e57")
    library = require("pye57.libe57", "e57")
    if not path.stat().st_size:
        raise InputError(f"{path}: is empty", code="file-empty")
    try:
        image = _image_file(str(path), path.stat().st_mtime_ns, path.stat().st_size)
        if not len(scans := image.root()["data3D"]):
            raise InputError(f"{path}: holds no scans: export at least one scan into it", code="file-empty")
        yield library, image, scans
    except library.E57Exception as error:
        raise damaged(path, first_line(error)) from None


@lru_cache(maxsize=1)
def _image_file(path: str, changed: int, size: int) -> Any:
    """Return the open file, cached for all of its scans; modification time and size identify its version."""
    return require("pye57.libe57", "e57").ImageFile(path, "r")


def _e57_points(library: ModuleType, image: Any, node: Any) -> tuple[Floats, Array | None]:
    """Return (N, 3) m in the scanner's frame and (N, 3) uint8 colors or None, of the points not marked invalid."""
    records = node["points"]
    prototype = library.StructureNode(records.prototype())
    axes = next((axes for axes in (_CARTESIAN, _SPHERICAL) if all(map(prototype.isDefined, axes))), None)
    if axes is None:
        raise InputError("the points have neither cartesian nor spherical coordinates", code="points-missing")
    invalid = "cartesianInvalidState" if axes is _CARTESIAN else "sphericalInvalidState"
    colored = all(map(prototype.isDefined, _COLORS))
    names = [*axes, *(_COLORS if colored else ()), *([invalid] if prototype.isDefined(invalid) else [])]
    count = records.childCount()
    check_points(count, "the scan")
    values = {name: np.zeros(count) for name in names}
    buffers = library.VectorSourceDestBuffer()
    for name, array in values.items():
        buffers.append(library.SourceDestBuffer(image, name, array, count, True, True))
    read = records.reader(buffers).read() if count else 0
    if read != count:
        raise InputError(f"its header declares {count} points, it holds {read}", code="file-damaged")
    valid = values[invalid] == 0 if invalid in values else np.ones(count, dtype=bool)
    first, second, third = (values[name][valid] for name in axes)
    if axes is _SPHERICAL:  # range, azimuth from x towards y, elevation from the xy plane
        horizontal = first * np.cos(third)
        first, second, third = horizontal * np.cos(second), horizontal * np.sin(second), first * np.sin(third)
    points = np.column_stack((first, second, third))
    if not colored:
        return points, None
    colors = np.column_stack([values[name][valid] for name in _COLORS])
    low, high = _color_limits(library, node, colors)
    return points, np.rint(255 * np.clip((colors - low) / (high - low), 0, 1)).astype(np.uint8)


def _color_limits(library: ModuleType, node: Any, colors: Floats) -> tuple[float, float]:
    """Return the color values of black and white: the declared ones, else those of 8 bits, or of 16 bits if values exceed 8."""
    if node.isDefined("colorLimits"):
        limits = node["colorLimits"]
        low, high = (float(limits[f"colorRed{end}"].value()) for end in ("Minimum", "Maximum"))
        if high > low:
            return low, high
    return 0.0, 255.0 if colors.max(initial=0) <= 255 else 65535.0


def _pose(node: Any) -> tuple[Floats, Floats] | None:
    """Return rotation (3, 3) and translation (3,) m, scanner to file; None if the pose is missing or the identity."""
    from scipy.spatial.transform import Rotation

    if not node.isDefined("pose"):
        return None
    pose, rotation, translation = node["pose"], np.array((1.0, 0.0, 0.0, 0.0)), np.zeros(3)
    if pose.isDefined("rotation"):
        rotation = np.array([float(pose["rotation"][name].value()) for name in "wxyz"])
    if pose.isDefined("translation"):
        translation = np.array([float(pose["translation"][name].value()) for name in "xyz"])
    if not (np.isfinite(rotation).all() and np.isfinite(translation).all() and np.linalg.norm(rotation) > 0):
        sentence = f"the pose is {rotation} {translation}, expected a unit quaternion w x y z and metres"
        raise InputError(sentence, code="pose-invalid")
    matrix = Rotation.from_quat(rotation[[1, 2, 3, 0]]).as_matrix()
    return None if np.array_equal(matrix, np.eye(3)) and not translation.any() else (matrix, translation)

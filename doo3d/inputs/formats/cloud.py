"""Open point clouds and meshes as captures: a file (PLY, text, NPZ, LAS, OBJ, E57 ...) or a folder of such files."""

import re
from functools import partial
from pathlib import Path
from typing import ClassVar

import numpy as np

from ...errors import InputError
from ...guard.guarding import prefixed, read_head
from ...guard.isolation import isolated
from ...types import Array, Cloud
from ..capture import FrameData, FrameRef
from ..read_options import DEFAULT, ReadOptions
from ..support.listing import images_in
from ._cloud_files import HEAD_BYTES, Points, is_npy_cloud, read_npy, read_npz, read_open3d
from ._laser_scans import count_e57, read_e57, read_las
from ._mesh_files import MESHES, has_faces, read_mesh
from ._npz_arrays import array_names
from ._text_clouds import find_table, is_ptx, read_ptx, read_text

SUFFIXES = (".ply", ".pcd", ".xyz", ".pts", ".ptx", ".npz", ".las", ".laz", ".e57")  # of files in folders
_SHARED_SUFFIXES = (".obj", ".stl", ".off", ".npy", ".csv", ".txt")  # in folders of clouds alone: they have other uses
_BESIDE_MESHES = (".mtl",)  # files that do not make a folder one of something else
_FIRST = re.compile(rb"\s*(?:#[^\n]*\n\s*)*(?:v|vn|vt|f|o|g|mtllib|usemtl)\s")  # the first line of an OBJ but comments


class CloudCapture:
    """A cloud file, or a folder of cloud files, opened as a capture: one frame per cloud, without times.

    Points are in metres in the file's own coordinates, with the viewpoint if the file has one. An E57 file with several scans
    gives one frame per scan, `<name>_000` and so on. The files of a folder come in natural order of their names (9 before 10); a
    file that cannot be read fails when its frame is loaded, and the other frames are still read.
    """

    what: ClassVar[str] = (
        "a cloud file, or a folder of them: PLY, PCD, XYZ, PTS, PTX, CSV (columns x y z, with r g b), NPZ (points, with colors), "
        "NPY (N, 3), LAS, LAZ, E57; or a mesh: OBJ, STL, OFF, PLY with faces"
    )
    format = "cloud"
    options: ClassVar[frozenset[str]] = frozenset({"depth_scale", "classification"})

    def __init__(self, path: Path, options: ReadOptions = DEFAULT) -> None:
        self.path = path
        files = list(images_in(path, (*SUFFIXES, *_SHARED_SUFFIXES)).values()) if path.is_dir() else [path]
        meshes = [file.name for file in files if _is_mesh(file)]
        self.notes = [f"{meshes[0]} is a mesh: points are drawn evenly on its faces, the same at each run"] if meshes else []
        self.frames = [frame for file in files for frame in _frames_of(file, options, single=file == path)]

    @staticmethod
    def can_read(path: Path) -> bool:
        """Return whether `path` is a cloud file by its first bytes or its suffix, or a folder with such files.

        In a folder, the suffix decides; an NPZ file counts only if it has an array `points`, and texts, arrays, OBJ, STL and OFF
        count only if all files in the folder are clouds.
        """
        if not path.is_dir():
            return path.is_file() and _kind(path) is not None
        files = [file for file in sorted(path.iterdir()) if not file.name.startswith(".")]
        if any(map(_is_cloud, files)):
            return True
        files = [file for file in files if file.suffix.lower() not in _BESIDE_MESHES]
        return bool(files) and all(file.suffix.lower() in _SHARED_SUFFIXES and file.is_file() and _kind(file) for file in files)


def _frames_of(file: Path, options: ReadOptions, single: bool) -> list[FrameRef]:
    count = 1
    try:
        if _kind(file) == "e57":
            count = isolated(count_e57, file, where=str(file))
    except (InputError, OSError):
        if single:
            raise
        # loading this frame reports the error
    names = [f"{file.stem}_{i:03d}" for i in range(count)] if count > 1 else [file.stem]
    load = partial(_load, file, options.depth_scale, options.classification)
    return [FrameRef(name, file, partial(load, name, i)) for i, name in enumerate(names)]


def _is_cloud(file: Path) -> bool:
    """Return whether a file in a folder is a cloud by its suffix; an NPZ file, also used by other formats, by its arrays."""
    if file.suffix.lower() != ".npz" or not file.is_file():
        return file.suffix.lower() in SUFFIXES and file.is_file()
    try:
        return "points" in array_names(file)
    except InputError:
        return False


def _kind(path: Path) -> str | None:
    """Return the kind of a cloud file by its first bytes, else by its suffix; None if it is no cloud."""
    head = read_head(path, HEAD_BYTES)
    first = next((line for line in head.splitlines() if line.strip() and not line.lstrip().startswith(b"#")), b"")
    lines, suffix = [line for line in head.decode("utf-8", "replace").splitlines() if line.strip()], path.suffix.lower()
    table = find_table(lines)
    signs: dict[str, object] = {
        "ply": re.match(rb"ply\s", head),
        "las": head.startswith(b"LASF"),
        "e57": head.startswith(b"ASTM-E57"),
        "pcd": head.startswith(b"# .PCD") or re.match(rb"(VERSION|FIELDS)\s", first),
        "npz": head.startswith(b"PK\x03\x04") and b".npy" in head,
        "npy": head.startswith(b"\x93NUMPY") and is_npy_cloud(path),
        "obj": suffix == ".obj" and _FIRST.match(head),
        "stl": suffix == ".stl",
        "off": re.match(rb"(?:ST)?(?:C|N)*OFF\s", head),
        "ptx": is_ptx(lines),
        "text": table is not None and table.is_cloud,
    }
    if (kind := next((kind for kind, sign in signs.items() if sign), None)) is not None:
        return kind
    # unknown content with the suffix of a cloud: the reader will report the reason
    return {".laz": "las", ".xyz": "text", ".pts": "text"}.get(suffix, suffix[1:]) if suffix in SUFFIXES else None


def _is_mesh(path: Path) -> bool:
    """Return whether a cloud file holds faces, to be sampled; False if it cannot be read."""
    try:
        kind = _kind(path)
        return kind in MESHES or (kind == "ply" and has_faces(read_head(path, HEAD_BYTES)))
    except OSError:
        return False


def _load(path: Path, scale: float | None, classes: tuple[int, ...] | None, name: str, scan: int) -> FrameData:
    with prefixed(str(path), path):
        if not path.stat().st_size:
            raise InputError(f"{path}: is empty", code="file-empty")
        read = _read(path, scan, scale is None, classes)
        points = read.points if scale in (None, 1) else read.points / scale
        viewpoint = None if read.viewpoint is None else read.viewpoint / (scale or 1)
        cloud = Cloud(points, _colors_8_bit(read.colors), viewpoint, name, notes=read.notes)
    if not len(cloud.points):
        raise InputError(f"{path}: holds no points with finite coordinates", code="cloud-empty")
    return FrameData(cloud)


def _read(path: Path, scan: int, converted: bool, classes: tuple[int, ...] | None) -> Points:
    """Read a cloud; formats that need a native library are read in a separate process."""
    kind = _kind(path) or ""
    if kind == "las":
        return isolated(read_las, path, converted, classes, where=str(path))
    if classes is not None:
        raise InputError(f"{path}: only points of LAS and LAZ files have classes: leave out classification", code="option-unused")
    if kind == "e57":
        return isolated(read_e57, path, scan, where=str(path))
    if _is_mesh(path):
        return isolated(read_mesh, path, kind, where=str(path))
    if kind in ("ply", "pcd"):
        return isolated(read_open3d, path, kind, where=str(path))
    return {"text": read_text, "ptx": read_ptx, "npz": read_npz, "npy": read_npy}[kind](path)


def _colors_8_bit(colors: Array | None) -> Array | None:
    """Return colors as uint8; floats are scaled from 0 to 1."""
    if colors is None or colors.dtype == np.uint8:
        return colors
    if not np.issubdtype(colors.dtype, np.floating) or not ((colors >= 0) & (colors <= 1)).all():
        raise InputError(f"colors are {colors.dtype}, expected uint8, or floats from 0 to 1", code="color-type")
    return np.asarray(np.rint(colors * 255), dtype=np.uint8)

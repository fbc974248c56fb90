"""Read meshes (OBJ, STL, OFF, PLY with faces) with trimesh, as points sampled evenly on the faces."""

import re
from pathlib import Path

import numpy as np

from ...errors import InputError
from ...guard.guarding import guarded, read_head
from ...guard.limits import check_points
from ._cloud_files import MAX_CLOUD_HEADER_BYTES, Points, damaged
from ._text_clouds import count_lines

MESHES = ("obj", "stl", "off")
"""Kinds of mesh files; a PLY file may also hold a mesh."""

_STL_HEAD = 84  # bytes before the triangles of a binary STL, the last four of which are their number
_STL_TRIANGLE_BYTES = 50
_POINTS_PER_VERTEX = 4  # drawn on the faces, so that a scanned mesh keeps its resolution,
_MIN_POINTS, _MAX_POINTS = 100_000, 1_000_000  # within which a CAD model's long faces are covered and a scan stays small
_SEED = 0


def has_faces(head: bytes) -> bool:
    """Return whether the header of a PLY file announces faces."""
    return re.search(rb"^element\s+face\s+0*[1-9]", head, re.MULTILINE) is not None


def read_mesh(path: Path, kind: str) -> Points:
    """Read a mesh (m) as points sampled evenly on its faces, the same in each call; kind : one of `MESHES`, or "ply".

    The colors are those of the vertices or faces; textures are not read. A mesh without faces gives its vertices.

    Raises
    ------
    InputError : the file is damaged, announces more than is allowed, or has no vertices.
    """
    import trimesh

    _check_size(path, kind)
    with guarded(path), path.open("rb") as file:
        loaded = trimesh.load(file, file_type=kind, process=False)
        mesh = loaded.to_mesh() if isinstance(loaded, trimesh.Scene) else loaded
        vertices, faces = np.asarray(mesh.vertices, dtype=float), getattr(mesh, "faces", ())
        if not len(faces):
            return Points(vertices.reshape(-1, 3))
        if not np.isfinite(vertices[faces]).all() or not mesh.area > 0:
            raise damaged(path, "its faces have no area, or vertices that are not finite")
        count = int(np.clip(_POINTS_PER_VERTEX * len(vertices), _MIN_POINTS, _MAX_POINTS))
        if mesh.visual.kind in ("vertex", "face"):
            points, _, colors = trimesh.sample.sample_surface(mesh, count, sample_color=True, seed=_SEED)
            return Points(np.asarray(points), np.asarray(colors)[:, :3].astype(np.uint8))
        return Points(np.asarray(trimesh.sample.sample_surface(mesh, count, seed=_SEED)[0]))


def _check_size(path: Path, kind: str) -> None:
    """Raise InputError if a mesh announces more vertices or faces than are allowed, or than the file can hold."""
    size = path.stat().st_size
    head = read_head(path, MAX_CLOUD_HEADER_BYTES)
    announced = (
        [int(number) for number in re.findall(rb"^element\s+\w+\s+(\d{1,30})", head, re.MULTILINE)] if kind == "ply" else []
    )
    if kind == "stl" and not head.lstrip().startswith(b"solid"):
        if size < _STL_HEAD:
            raise InputError(f"{path}: is cut off: it ends in the header of an STL file", code="file-damaged")
        announced = [int.from_bytes(head[_STL_HEAD - 4 : _STL_HEAD], "little")]
        if _STL_HEAD + _STL_TRIANGLE_BYTES * announced[0] > size:
            raise damaged(path, f"its header declares {announced[0]} triangles, more than fit into the file")
    elif kind != "ply":
        announced = [count_lines(path)]
    check_points(max(announced, default=0), str(path))
    if kind == "ply" and max(announced, default=0) > size:
        raise damaged(path, f"its header declares {max(announced)} vertices or faces, more than fit into the file")

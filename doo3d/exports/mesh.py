"""Meshes: a closed cylinder per segment, coloured by chain, what is occluded apart from what was seen."""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from ..errors import require
from ..types import Detection
from .base import Thick, colors, labels, upright
from .link_frames import link_frames

# glTF: y up, z towards the viewer; a camera has y down and z away, other coordinates z up
CAMERA_UP = np.diag([1.0, -1.0, -1.0, 1.0])
Z_UP = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
EMPTY_PLY = """ply
format binary_little_endian 1.0
element vertex 0
property float x
property float y
property float z
element face 0
property list uchar int vertex_indices
end_header
"""


class _Mesh(Thick):
    sides: int = Field(16, ge=3, le=256, description="of each cylinder; its corners lie on the surface")

    def parts(self, found: Detection) -> Iterator[tuple[str, Any]]:
        """(name, mesh) of each chain, and of what of it is occluded: `chain0`, `chain0_occluded`."""
        trimesh = require("trimesh")
        for label, chain in zip(labels(found), found.chains, strict=True):
            radius, frames = self.radius_of(chain), link_frames(chain.joints)
            middles = (chain.joints[1:] + chain.joints[:-1]) / 2
            for hidden, color in enumerate(colors(label)):
                cylinders = []
                for k in np.flatnonzero(chain.occluded == bool(hidden)):
                    place = np.eye(4)
                    place[:3, :3], place[:3, 3] = frames[k], middles[k]
                    cylinders.append(trimesh.creation.cylinder(radius, chain.segment_length, self.sides, transform=place))
                if cylinders:
                    mesh = trimesh.util.concatenate(cylinders)
                    mesh.visual = trimesh.visual.ColorVisuals(mesh, vertex_colors=np.tile((*color, 255), (len(mesh.vertices), 1)))
                    yield f"chain{label}" + "_occluded" * hidden, mesh


class Ply(_Mesh):
    """One mesh; vertices in the chain's colour, of what is occluded paler."""

    what: ClassVar[str] = "mesh of all cylinders, coloured"
    suffixes: ClassVar[tuple[str, ...]] = (".ply",)

    def write(self, frames: Sequence[Detection], path: Path) -> None:
        """Binary, with float32 coordinates."""
        meshes = [mesh for _, mesh in self.parts(frames[0])]
        whole = require("trimesh").util.concatenate(meshes) if meshes else None
        path.write_bytes(whole.export(file_type="ply", vertex_normal=False) if whole else EMPTY_PLY.encode("ascii"))


class Obj(_Mesh):
    """An object (`o`) per part, with colours at the vertices (`v x y z r g b`)."""

    what: ClassVar[str] = "mesh, an object per chain, what is occluded apart"
    suffixes: ClassVar[tuple[str, ...]] = (".obj",)

    def write(self, frames: Sequence[Detection], path: Path) -> None:
        """Text, 9 decimals."""
        lines, before = ["# doo3d, metres"], 1
        for name, mesh in self.parts(frames[0]):
            lines.append(f"o {name}")
            shade = np.asarray(mesh.visual.vertex_colors[:, :3]) / 255
            lines += [("v" + " %.9f" * 3 + " %.4f" * 3) % (*at, *rgb) for at, rgb in zip(mesh.vertices, shade, strict=True)]
            lines += ["f {} {} {}".format(*face) for face in (mesh.faces + before).tolist()]
            before += len(mesh.vertices)
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")


class Glb(_Mesh):
    """A node per part, in the file's y-up coordinates."""

    what: ClassVar[str] = "glTF mesh, a node per chain, what is occluded apart"
    suffixes: ClassVar[tuple[str, ...]] = (".glb",)

    def write(self, frames: Sequence[Detection], path: Path) -> None:
        """Nodes are turned so that the scene stands upright; below them coordinates are the detection's."""
        scene = require("trimesh").Scene()
        place = Z_UP if upright(frames[0]) else CAMERA_UP
        for name, mesh in self.parts(frames[0]):
            scene.add_geometry(mesh, node_name=name, geom_name=name, transform=place)
        path.write_bytes(scene.export(file_type="glb") if scene.geometry else _empty_glb())


def _empty_glb() -> bytes:
    """A container with one JSON chunk, padded with blanks to a multiple of 4 bytes."""
    text = json.dumps({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{}]}).encode()
    text += b" " * (-len(text) % 4)
    return b"glTF" + struct.pack("<IIII", 2, 20 + len(text), len(text), 0x4E4F534A) + text

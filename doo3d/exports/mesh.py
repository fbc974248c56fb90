"""Meshes: a closed cylinder per segment, colored by chain, with occluded segments in a mesh of their own."""

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
from .base import RadiusExport, colors, is_z_up, labels
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


class _Mesh(RadiusExport):
    sides: int = Field(16, ge=3, le=256, description="number of sides of each cylinder; their edges lie on the surface")

    def parts(self, detection: Detection) -> Iterator[tuple[str, Any]]:
        """Yield (name, trimesh.Trimesh) for the visible and for the occluded segments of each chain.

        The names are `chain0` and `chain0_occluded`, with the chain's number; a part without segments is left out. Each segment
        is a closed cylinder of the chain's radius, in metres and in the coordinates of the detection; its color is at the
        vertices.

        Raises
        ------
        InputError
            the radius of a chain is unknown.
        MissingDependency
            trimesh is not installed.
        """
        trimesh = require("trimesh")
        for label, chain in zip(labels(detection), detection.chains, strict=True):
            radius, frames = self.radius_of(chain), link_frames(chain.joints)
            centers = (chain.joints[1:] + chain.joints[:-1]) / 2
            for occluded, color in enumerate(colors(label)):
                cylinders = []
                for k in np.flatnonzero(chain.occluded == bool(occluded)):
                    pose = np.eye(4)
                    pose[:3, :3], pose[:3, 3] = frames[k], centers[k]
                    cylinders.append(trimesh.creation.cylinder(radius, chain.segment_length, self.sides, transform=pose))
                if cylinders:
                    mesh = trimesh.util.concatenate(cylinders)
                    mesh.visual = trimesh.visual.ColorVisuals(mesh, vertex_colors=np.tile((*color, 255), (len(mesh.vertices), 1)))
                    yield f"chain{label}" + "_occluded" * occluded, mesh


class Ply(_Mesh):
    """PLY: one mesh of all chains. Vertices have the color of their chain, paler at occluded segments."""

    summary: ClassVar[str] = "mesh of all cylinders, colored"
    suffixes: ClassVar[tuple[str, ...]] = (".ply",)

    def write(self, frames: Sequence[Detection], path: Path) -> None:
        """Write the mesh of one frame as binary PLY with float32 coordinates, m; without chains, a valid PLY with no vertex."""
        meshes = [mesh for _, mesh in self.parts(frames[0])]
        combined = require("trimesh").util.concatenate(meshes) if meshes else None
        path.write_bytes(combined.export(file_type="ply", vertex_normal=False) if combined else EMPTY_PLY.encode("ascii"))


class Obj(_Mesh):
    """Wavefront OBJ: an object `chain0` of the visible segments of each chain, and `chain0_occluded` of its occluded ones."""

    summary: ClassVar[str] = "mesh, an object per chain, occluded segments separate"
    suffixes: ClassVar[tuple[str, ...]] = (".obj",)

    def write(self, frames: Sequence[Detection], path: Path) -> None:
        """Write the meshes of one frame as text, with a line `v x y z r g b` per vertex.

        Coordinates are in m with 9 decimals, colors are 0 to 1.
        """
        lines, first = ["# doo3d, metres"], 1
        for name, mesh in self.parts(frames[0]):
            lines.append(f"o {name}")
            share = np.asarray(mesh.visual.vertex_colors[:, :3]) / 255
            lines += [("v" + " %.9f" * 3 + " %.4f" * 3) % (*at, *rgb) for at, rgb in zip(mesh.vertices, share, strict=True)]
            lines += ["f {} {} {}".format(*face) for face in (mesh.faces + first).tolist()]
            first += len(mesh.vertices)
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")


class Glb(_Mesh):
    """Binary glTF: a node `chain0` of the visible segments of each chain, and `chain0_occluded` of its occluded ones."""

    summary: ClassVar[str] = "glTF mesh, a node per chain, occluded segments separate"
    suffixes: ClassVar[tuple[str, ...]] = (".glb",)

    def write(self, frames: Sequence[Detection], path: Path) -> None:
        """Write the meshes of one frame, m.

        The vertices keep the coordinates of the detection. A rotation in each node turns them to the axes of glTF (x right, y
        up, z towards the viewer). A camera's coordinates are taken as x right, y down, z forward; all others as z up.
        """
        scene = require("trimesh").Scene()
        transform = Z_UP if is_z_up(frames[0]) else CAMERA_UP
        for name, mesh in self.parts(frames[0]):
            scene.add_geometry(mesh, node_name=name, geom_name=name, transform=transform)
        path.write_bytes(scene.export(file_type="glb") if scene.geometry else _empty_glb())


def _empty_glb() -> bytes:
    """Return a container with one JSON chunk, padded with spaces to a multiple of 4 bytes."""
    text = json.dumps({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{}]}).encode()
    text += b" " * (-len(text) % 4)
    return b"glTF" + struct.pack("<IIII", 2, 20 + len(text), len(text), 0x4E4F534A) + text

"""Export meshes: a closed cylinder per segment, colored by chain, with occluded segments in a separate mesh."""

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
MIN_BRIDGE_RADII = 0.1  # between the end of a chain and a junction, below which no cylinder is needed
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
        """Yield up to two meshes per chain, as (name, trimesh.Trimesh): the visible and the occluded segments.

        The names are `chain0` and `chain0_occluded` for the chain with the number 0; a mesh without segments is left out. Then
        one mesh per junction, `junction0`, in the color of its first chain, closes the gap between the chains' ends. Each
        segment is a closed cylinder with the radius of the whole chain. Vertices are in m, in the coordinates of the detection,
        and have a color.

        Raises
        ------
        InputError
            the radius of a chain is unknown and the option `radius` is not set.
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
        yield from self._junctions(trimesh, detection)

    def _junctions(self, trimesh: Any, detection: Detection) -> Iterator[tuple[str, Any]]:
        """Yield a mesh per junction: a sphere, and cylinders to the chain ends, which are up to half a segment away."""
        for number, junction in enumerate(detection.junctions):
            radii = [self.radius_of(detection.chains[end.chain]) for end in junction.ends]
            sphere = trimesh.creation.icosphere(subdivisions=2, radius=max(radii))
            sphere.apply_translation(junction.position)
            parts = [sphere]
            for end, radius in zip(junction.ends, radii, strict=True):
                joint = detection.chains[end.chain].joints[-end.end]
                if np.linalg.norm(joint - junction.position) > MIN_BRIDGE_RADII * radius:
                    parts.append(trimesh.creation.cylinder(radius, sections=self.sides, segment=(joint, junction.position)))
            mesh = trimesh.util.concatenate(parts)
            color = colors(labels(detection)[junction.ends[0].chain])[0]
            mesh.visual = trimesh.visual.ColorVisuals(mesh, vertex_colors=np.tile((*color, 255), (len(mesh.vertices), 1)))
            yield f"junction{number}", mesh


class Ply(_Mesh):
    """Export format PLY: one mesh of all chains of a frame; vertices have their chain's color, paler at occluded segments."""

    summary: ClassVar[str] = "mesh of all cylinders, colored"
    suffixes: ClassVar[tuple[str, ...]] = (".ply",)

    def write(self, frames: Sequence[Detection], path: Path) -> None:
        """Write one mesh of all chains of the frame `frames[0]` as binary PLY.

        Vertices are float32, in m, in the coordinates of the detection. Without chains, the file is a valid PLY without vertices.

        Raises
        ------
        InputError
            the radius of a chain is unknown and the option `radius` is not set.
        MissingDependency
            trimesh is not installed.
        """
        meshes = [mesh for _, mesh in self.parts(frames[0])]
        combined = require("trimesh").util.concatenate(meshes) if meshes else None
        path.write_bytes(combined.export(file_type="ply", vertex_normal=False) if combined else EMPTY_PLY.encode("ascii"))


class Obj(_Mesh):
    """Export format OBJ (Wavefront): per chain an object `chain0` (its visible segments) and `chain0_occluded` (the others)."""

    summary: ClassVar[str] = "mesh, an object per chain, occluded segments separate"
    suffixes: ClassVar[tuple[str, ...]] = (".obj",)

    def write(self, frames: Sequence[Detection], path: Path) -> None:
        """Write the chains of the frame `frames[0]` as OBJ text, with up to two objects per chain.

        Each vertex is a line `v x y z r g b`: position in m with 9 decimals, in the coordinates of the detection, and color, 0 to
        1. InputError is raised if the radius of a chain is unknown and the option `radius` is not set.
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
    """Export format binary glTF: per chain a node `chain0` (its visible segments) and `chain0_occluded` (the occluded ones)."""

    summary: ClassVar[str] = "glTF mesh, a node per chain, occluded segments separate"
    suffixes: ClassVar[tuple[str, ...]] = (".glb",)

    def write(self, frames: Sequence[Detection], path: Path) -> None:
        """Write the chains of the frame `frames[0]` as a binary glTF file (.glb), with up to two meshes per chain.

        Vertices are in m, in the coordinates of the detection. Each mesh's node has a rotation that turns the vertices to glTF's
        axes (x right, y up, z towards the viewer): from x right, y down, z forward if the coordinates are a camera's, otherwise
        from z up. InputError is raised if the radius of a chain is unknown and the option `radius` is not set.
        """
        scene = require("trimesh").Scene()
        transform = Z_UP if is_z_up(frames[0]) else CAMERA_UP
        for name, mesh in self.parts(frames[0]):
            scene.add_geometry(mesh, node_name=name, geom_name=name, transform=transform)
        path.write_bytes(scene.export(file_type="glb") if scene.geometry else _empty_glb())


def _empty_glb() -> bytes:
    """Return a valid binary glTF file without meshes: a container with one JSON chunk, padded to a multiple of 4 bytes."""
    text = json.dumps({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{}]}).encode()
    text += b" " * (-len(text) % 4)
    return b"glTF" + struct.pack("<IIII", 2, 20 + len(text), len(text), 0x4E4F534A) + text

"""Export evenly spaced points along a chain, the initial state of a tracker."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from ..types import Detection, Floats
from .base import Export

PCD = """# .PCD v0.7 - Point Cloud Data file format
VERSION 0.7
FIELDS x y z
SIZE 4 4 4
TYPE F F F
COUNT 1 1 1
WIDTH {count}
HEIGHT 1
VIEWPOINT 0 0 0 1 0 0 0
POINTS {count}
DATA binary
"""


class Nodes(Export):
    """Export format with one file per chain: M evenly spaced points from its first to its last joint; M is the option `count`.

    A file has M rows x, y, z, in m, in the coordinates of the detection. Its type follows from its suffix: .npy, .pcd or .json.
    Files in a folder have the type that the option `file` names.
    """

    summary: ClassVar[str] = "evenly spaced points of a chain, the initial state of trackers (TrackDLO, CDCPD)"
    suffixes: ClassVar[tuple[str, ...]] = (".npy", ".pcd", ".json")
    file_per: ClassVar[Any] = "chain"

    count: int = Field(45, ge=2, description="number of points, M")
    file: Literal["npy", "pcd", "json"] = Field(
        "npy", description="type of files in a folder; a single file has that of its suffix"
    )

    @property
    def suffix(self) -> str:
        """The suffix of files written into a folder, from the option `file`: ".npy", ".pcd" or ".json"."""
        return f".{self.file}"

    def write(self, frames: Sequence[Detection], path: Path) -> None:
        """Write M points of the first chain of `frames[0]`, in m; the suffix of `path` chooses the file format.

        `.npy` is an (M, 3) float64 array. `.pcd` is a binary point cloud with float32 coordinates. `.json` is an object with
        "nodes" (M lists [x, y, z]) and "edges" (M - 1 lists [k, k + 1] of indices of consecutive nodes). Without chains, the file
        has no points.
        """
        points = frames[0].chains[0].nodes(self.count) if frames[0].chains else np.zeros((0, 3))
        {".npy": _npy, ".pcd": _pcd, ".json": _json}[path.suffix.lower()](path, points)


def _npy(path: Path, points: Floats) -> None:
    with path.open("xb") as file:
        np.save(file, points)


def _pcd(path: Path, points: Floats) -> None:
    path.write_bytes(PCD.format(count=len(points)).encode("ascii") + points.astype("<f4").tobytes())


def _json(path: Path, points: Floats) -> None:
    edges = [[k, k + 1] for k in range(len(points) - 1)]
    path.write_text(json.dumps({"nodes": points.tolist(), "edges": edges}) + "\n", encoding="utf-8")

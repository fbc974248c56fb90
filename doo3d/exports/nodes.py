"""Evenly spaced points along a chain, the initial state of a tracker."""

from __future__ import annotations

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
    """Evenly spaced points of one chain, from its first joint to its last: (M, 3) m, with M the option `count`."""

    summary: ClassVar[str] = "evenly spaced points of a chain, the initial state of trackers (TrackDLO, CDCPD)"
    suffixes: ClassVar[tuple[str, ...]] = (".npy", ".pcd", ".json")
    file_per: ClassVar[Any] = "chain"

    count: int = Field(45, ge=2, description="number of points, M")
    file: Literal["npy", "pcd", "json"] = Field(
        "npy", description="type of files in a folder; a single file has that of its suffix"
    )

    @property
    def suffix(self) -> str:
        """The suffix of the files that doo3d itself names, from the option `file`: ".npy", ".pcd" or ".json"."""
        return f".{self.file}"

    def write(self, frames: Sequence[Detection], path: Path) -> None:
        """Write the points of one chain in the format that the suffix of `path` names.

        `.npy` is an (M, 3) float64 array, `.pcd` is binary with float32 coordinates, and `.json` has "nodes" (M lists [x, y,
        z]) and "edges" ([k, k + 1], indices of consecutive nodes). For a frame without chains, M is 0.
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

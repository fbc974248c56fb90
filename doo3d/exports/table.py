"""Export all frames as one table, one row per joint."""

import csv
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar, Literal

from pydantic import Field

from ..types import Detection
from ..types.tables import DEVIATIONS, cell
from .motion import JointMotion, MotionExport
from .trees import graph_of

COLUMNS = ["frame", "timestamp", "chain", "id", "closed", "segment_length", "chain_radius", "joint"]
EDGE_COLUMNS = ["frame", "chain", "object", "first_node", "last_node", "length", "radius", "confidence"]
FLAGS = ("closed", "occluded", "from_time")


class Csv(MotionExport):
    """Export format CSV: one table of all frames of a capture, a row per joint, with numbers in full precision."""

    summary: ClassVar[str] = "table of the whole capture, a row per joint"
    suffixes: ClassVar[tuple[str, ...]] = (".csv",)
    file_per: ClassVar[Any] = "capture"
    supports_2d: ClassVar[bool] = True

    table: Literal["joints", "nodes", "edges"] = Field(
        "joints",
        description="rows: joints of chains; or the graph of branched objects: nodes (junctions and tips), or edges (chains)",
    )

    def write(self, frames: Sequence[Detection], path: Path) -> None:
        """Write the table of all frames, with a header line and a row per joint.

        The columns are: frame (name), timestamp (s), chain (number in its frame, from 0), id, closed (0 or 1), segment_length,
        chain_radius, joint (number in its chain, from 0), x, y, z (no z in 2-D), radius (at the joint), occluded (0 or 1, of
        the segment that starts at the joint), depth ("seen" or "filled", of the same segment; not in 2-D), from_time (0 or 1,
        of the same segment), deviation_across and deviation_along (standard deviations of the joint; not in 2-D), vx, vy, vz
        and ax, ay, az (velocity and acceleration of the joint, per s and per s²). Lengths are in m, or px in 2-D. An unknown
        timestamp, id, deviation, velocity or acceleration is an empty field, an unknown radius is "nan". `occluded`, `depth`
        and `from_time` are empty at the last joint of a chain. A name that begins like a formula has an apostrophe before it.

        With the option `table` set to nodes: frame, node (number in its frame), kind ("junction" or "tip"), x, y, z. With edges:
        frame, chain, object, first_node, last_node, length, radius, confidence.
        """
        if self.table != "joints":
            _write_graph(frames, path, self.table)
            return
        planar = bool(frames) and all(frame.mode == "2d" for frame in frames)
        axes = "xy" if planar else "xyz"
        columns = [
            *COLUMNS,
            *axes,
            "radius",
            "occluded",
            *([] if planar else ["depth"]),
            "from_time",
            *(() if planar else DEVIATIONS),
        ]
        columns += [f"{quantity}{axis}" for quantity in "va" for axis in axes]
        with path.open("x", newline="", encoding="utf-8") as file:
            table = csv.writer(file, lineterminator="\n")
            table.writerow(columns)
            for frame, motions in zip(frames, self.motions_of(frames), strict=True):
                joints = frame.table("joints") | _motion_columns(motions, axes)
                empty = [None] * len(joints["frame"])
                values = [_as_digits(joints[name]) if name in FLAGS else joints.get(name, empty) for name in columns]
                table.writerows(zip(*(map(cell, column) for column in values), strict=True))


def _write_graph(frames: Sequence[Detection], path: Path, table: str) -> None:
    """Write a row per node, or per edge, of the graph of all frames."""
    planar = bool(frames) and all(frame.mode == "2d" for frame in frames)
    with path.open("x", newline="", encoding="utf-8") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(["frame", "node", "kind", *("xy" if planar else "xyz")] if table == "nodes" else EDGE_COLUMNS)
        for frame in frames:
            graph = graph_of(frame)
            if table == "nodes":
                for number, position in enumerate(graph.positions.tolist()):
                    rows.writerow([cell(frame.frame), number, "junction" if graph.junction[number] else "tip", *position])
            else:
                for number, chain in enumerate(frame.chains):
                    first, last = graph.edges[number].tolist()
                    values = [int(graph.objects[number]), first, last, chain.length, chain.radius, chain.confidence]
                    rows.writerow([cell(frame.frame), number, *values])


def _as_digits(flags: list[bool | None]) -> list[int | None]:
    return [None if flag is None else int(flag) for flag in flags]


def _motion_columns(motions: list[JointMotion], axes: str) -> dict[str, list[float | None]]:
    """Return the columns vx, ... and ax, ... of the joints of all chains of a frame; None if unknown."""
    columns: dict[str, list[float | None]] = {}
    for k, axis in enumerate(axes):
        columns[f"v{axis}"] = [_if_known(value) for motion in motions for value in motion.velocity[:, k].tolist()]
        columns[f"a{axis}"] = [_if_known(value) for motion in motions for value in motion.acceleration[:, k].tolist()]
    return columns


def _if_known(value: float) -> float | None:
    return None if math.isnan(value) else value

"""All frames in one table, one row per joint."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar, Literal

from pydantic import Field

from ..types import Detection
from .base import Export
from .trees import graph_of

COLUMNS = ["frame", "timestamp", "chain", "id", "closed", "segment_length", "chain_radius", "joint"]
EDGE_COLUMNS = ["frame", "chain", "object", "first_node", "last_node", "length", "radius", "confidence"]
FLAGS = ("closed", "occluded")


class Csv(Export):
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
        chain_radius, joint (number in its chain, from 0), x, y, z (no z in 2-D), radius (at the joint), occluded (0 or 1, of the
        segment that starts at the joint), depth ("seen" or "filled", of the same segment; not in 2-D). Lengths are in m, or px in
        2-D. An unknown timestamp or id is an empty field, an unknown radius is "nan", and `occluded` and `depth` are empty at the
        last joint of a chain.

        With the option `table` set to nodes: frame, node (number in its frame), kind ("junction" or "tip"), x, y, z. With edges:
        frame, chain, object, first_node, last_node, length, radius, confidence.
        """
        if self.table != "joints":
            _write_graph(frames, path, self.table)
            return
        planar = bool(frames) and all(frame.mode == "2d" for frame in frames)
        columns = [*COLUMNS, *("xy" if planar else "xyz"), "radius", "occluded", *([] if planar else ["depth"])]
        with path.open("x", newline="", encoding="utf-8") as file:
            table = csv.writer(file, lineterminator="\n")
            table.writerow(columns)
            for frame in frames:
                joints = frame.table("joints")
                empty = [None] * len(joints["frame"])
                values = [_as_digits(joints[name]) if name in FLAGS else joints.get(name, empty) for name in columns]
                table.writerows(zip(*values, strict=True))


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
                    rows.writerow([frame.frame, number, "junction" if graph.junction[number] else "tip", *position])
            else:
                for number, chain in enumerate(frame.chains):
                    first, last = graph.edges[number].tolist()
                    values = [int(graph.objects[number]), first, last, chain.length, chain.radius, chain.confidence]
                    rows.writerow([frame.frame, number, *values])


def _as_digits(flags: list[bool | None]) -> list[int | None]:
    return [None if flag is None else int(flag) for flag in flags]

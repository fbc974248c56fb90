"""All frames in one table, one row per joint."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar

from ..types import Detection
from .base import Export

COLUMNS = ["frame", "timestamp", "chain", "id", "closed", "segment_length", "chain_radius", "joint"]


class Csv(Export):
    """CSV table of all frames of a capture, one row per joint. Numbers are in full precision: reading them back is exact."""

    summary: ClassVar[str] = "table of the whole capture, a row per joint"
    suffixes: ClassVar[tuple[str, ...]] = (".csv",)
    file_per: ClassVar[Any] = "capture"
    supports_2d: ClassVar[bool] = True

    def write(self, frames: Sequence[Detection], path: Path) -> None:
        """Write the table of all frames, with a header line.

        Unknown values are empty fields. `occluded` (0 or 1) describes the segment that starts at the joint; it is empty at the
        last joint.
        """
        axes = "xy" if frames and all(frame.mode == "2d" for frame in frames) else "xyz"
        with path.open("x", newline="", encoding="utf-8") as file:
            table = csv.writer(file, lineterminator="\n")
            table.writerow([*COLUMNS, *axes, "radius", "occluded"])
            for frame in frames:
                table.writerows(_rows(frame))


def _rows(frame: Detection) -> list[list[Any]]:
    """Return a row per joint; `occluded` is of the segment that starts there, empty at the last joint."""
    rows: list[list[Any]] = []
    stamp = None if frame.timestamp is None else float(frame.timestamp)
    for number, chain in enumerate(frame.chains):
        sizes = [float(chain.segment_length), float(chain.radius)]
        head = [frame.frame, stamp, number, chain.id, int(chain.closed), *sizes]
        occluded = [*map(int, chain.occluded), None]
        for joint, (at, radius, is_occluded) in enumerate(
            zip(chain.joints.tolist(), chain.radii.tolist(), occluded, strict=True)
        ):
            rows.append([*head, joint, *at, radius, is_occluded])
    return rows

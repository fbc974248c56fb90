"""Rows as a table for people, as CSV and as JSON."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping, Sequence
from typing import Any

from ...outputs.detection_json import dumps
from .rows import Row, Summary, by_family, summary

SCHEMA = "doo3d/evaluation/1"
COLUMNS = (
    ("frames correct", "", 15),
    ("number", "right", 8),
    ("surest", "90 %", 8),
    ("occlusions", "correct", 15),
    ("merges", "correct", 15),
    ("connections", "correct", 20),
    ("", "wrong", 6),
    ("upper", "strand", 15),
    ("RMS seen", "mm", 9),
    ("hidden", "mm", 7),
    ("nodes", "mm", 6),
    ("ends", "mm", 6),
    ("radius", "ratio", 7),
    ("time", "ms", 6),
)


def format_table(rows: Sequence[Row]) -> str:
    """Per family and in all: counts by the paper's strict rule; medians over frames of distances, radius and time.

    number right: frames with as many chains as objects. surest 90 %: correct ones of the frames without the tenth whose
    connections are least sure. upper strand: crossings at which the right strand is on top, of all that the camera sees.
    """
    families = by_family(rows)
    wide = max(map(len, [*families, "all"]))
    lines = [" ".join([" " * wide, *(f"{column[k]:>{column[2]}s}" for column in COLUMNS)]) for k in (0, 1)]
    lines += [_line(family, wide, summary(own)) for family, own in families.items()]
    if len(families) > 1:
        lines += ["-" * len(lines[0]), _line("all", wide, summary(rows))]
    return "\n".join(lines)


def _line(name: str, wide: int, own: Summary) -> str:
    cells = (
        _share(own.frames_correct, own.frames, 1),
        _percent(own.number_right, own.frames),
        _percent(own.surest_correct, own.surest),
        _share(own.occlusions_correct, own.occlusions, 1),
        _share(own.merges_correct, own.merges, 1),
        _share(own.connections_correct, own.connections, 2),
        f"{own.connections - own.connections_correct}",
        _share(own.crossings_right, own.crossings, 1),
        _number(own.rms_seen, 2),
        _number(own.rms_hidden, 2),
        _number(own.node_error, 1),
        _number(own.end_error, 1),
        _number(own.radius_ratio, 2),
        _number(own.ms, 0),
    )
    return " ".join([f"{name:{wide}s}", *(f"{cell:>{column[2]}s}" for cell, column in zip(cells, COLUMNS, strict=True))])


def csv_text(rows: Sequence[Row]) -> str:
    """A line per frame below a line of names; numbers in full, what is not known left empty."""
    file = io.StringIO()
    table = csv.writer(file, lineterminator="\n")
    for k, row in enumerate(rows):
        values = row.to_dict()
        if k == 0:
            table.writerow(values)
        table.writerow(["" if _unknown(value) else value for value in values.values()])
    return file.getvalue()


def json_text(rows: Sequence[Row], settings: Mapping[str, Any]) -> str:
    """The settings, the summary of each family and of all, and every frame; null for what is not known."""
    groups = by_family(rows) | {"all": list(rows)}
    summaries = {name: summary(own).to_dict() for name, own in groups.items()}
    frames = [row.to_dict() for row in rows]
    return dumps({"schema": SCHEMA, "settings": dict(settings), "summary": summaries, "frames": frames})


def _unknown(value: Any) -> bool:
    return value is None or (isinstance(value, float) and not math.isfinite(value))


def _percent(good: int, total: int) -> str:
    return f"{100 * good / total:.1f} %" if total else "-"


def _share(good: int, total: int, digits: int) -> str:
    return f"{good}/{total} {100 * good / total:.{digits}f} %" if total else "-"


def _number(value: float, digits: int) -> str:
    return f"{value:.{digits}f}" if math.isfinite(value) else "-"

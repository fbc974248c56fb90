"""Format the results of frames as a text table, as CSV and as JSON."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

from ...outputs.detection_json import dumps
from .rows import (
    MOST_CONFIDENT_FRACTION,
    ReliabilityBin,
    Row,
    Summary,
    by_family,
    most_confident_part,
    reliability,
    summary,
)

SCHEMA = "doo3d/evaluation/2"
COLUMNS = (
    ("frames correct", "", 15),
    ("number", "correct", 8),
    ("confident", "90 %", 9),
    ("right in", "image", 9),
    ("occlusions", "correct", 15),
    ("merges", "correct", 15),
    ("connections", "correct", 20),
    ("", "wrong", 6),
    ("upper", "strand", 15),
    ("RMS seen", "mm", 9),
    ("hidden", "mm", 7),
    ("image", "px", 6),
    ("nodes", "mm", 6),
    ("ends", "mm", 6),
    ("radius", "ratio", 7),
    ("time", "ms", 6),
)
"""Two lines of a column's title, and its width in characters."""


def format_table(rows: Sequence[Row]) -> str:
    """Return a text table with a line for each family of frames and one for all.

    The columns are:

    - frames correct: frames correct by the strict rule of Keipour et al. (RA-L 2022), of all frames;
    - number correct: frames with as many chains as true cables, in %;
    - confident 90 %: correct frames in % of the frames without the tenth that have the least confidence;
    - right in image: frames correct by the same rule for chains and cables projected into the image, in %;
    - occlusions correct, merges correct, connections correct: correct ones of all;
    - wrong: number of wrong connections;
    - upper strand: crossings detected with the right cable on top, of those whose upper cable is seen;
    - RMS seen, hidden: RMS distance from the true axis, where the axis is seen and where it is hidden, mm, median over frames;
    - image: RMS distance from the projected axis where it is seen, px, median over frames;
    - nodes, ends: distance of joints and of ends from those of the true cable, mm, median over frames;
    - radius: detected over true radius, median over frames;
    - time: duration of a detection, ms, median over frames.

    A value that is unknown is shown as "-". If there are frames without a cable, a last line says how many of them show no chain.
    """
    families = by_family(rows)
    name_width = max(map(len, [*families, "all"]))
    lines = [" ".join([" " * name_width, *(f"{column[k]:>{column[2]}s}" for column in COLUMNS)]) for k in (0, 1)]
    lines += [_line(family, name_width, summary(group)) for family, group in families.items()]
    if len(families) > 1:
        lines += ["-" * len(lines[0]), _line("all", name_width, summary(rows))]
    empty = [row.score.chains == 0 for row in rows if row.score.objects == 0 and row.error is None]
    if empty:
        lines.append(f"no chain in {_share(sum(empty), len(empty), 1)} of the frames without a cable")
    return "\n".join(lines)


def format_reliability(rows: Sequence[Row]) -> str:
    """Return a text table that tells what the confidences of the frames are worth: how many of the frames of each are right.

    A line for each bin of confidence, from the highest down, with the number of frames, their mean confidence, and the share that
    is correct and that is right in the image. The last line is of the 75 % of the frames with the most confidence.
    """
    head = f"{'confidence':<22s} {'frames':>6s} {'mean':>5s} {'frames correct':>15s} {'right in image':>15s}"
    lines = [_reliability_line(f"{each.low:g} to {each.high:g}", each) for each in reversed(reliability(rows)) if each.frames]
    part = most_confident_part(rows)
    lines.append(_reliability_line(f"{MOST_CONFIDENT_FRACTION:.0%} most confident".replace("%", " %"), part))
    return "\n".join([head, *lines])


def _reliability_line(name: str, each: ReliabilityBin) -> str:
    correct, in_image = _share(each.correct, each.frames, 1), _share(each.image_correct, each.image_frames, 1)
    return f"{name:<22s} {each.frames:>6d} {_number(each.confidence, 2):>5s} {correct:>15s} {in_image:>15s}"


def _line(name: str, name_width: int, total: Summary) -> str:
    cells = (
        _share(total.frames_correct, total.frames, 1),
        _percent(total.count_correct, total.frames),
        _percent(total.confident_correct, total.confident),
        _percent(total.image_correct, total.image_frames),
        _share(total.occlusions_correct, total.occlusions, 1),
        _share(total.merges_correct, total.merges, 1),
        _share(total.connections_correct, total.connections, 2),
        f"{total.connections - total.connections_correct}",
        _share(total.crossings_correct, total.crossings, 1),
        _number(total.rms_seen, 2),
        _number(total.rms_hidden, 2),
        _number(total.image_rms, 2),
        _number(total.node_error, 1),
        _number(total.end_error, 1),
        _number(total.radius_ratio, 2),
        _number(total.ms, 0),
    )
    values = zip(cells, COLUMNS, strict=True)
    return " ".join([f"{name:{name_width}s}", *(f"{cell:>{column[2]}s}" for cell, column in values)])


def csv_text(rows: Sequence[Row]) -> str:
    """Return the rows as CSV text: a line of column names (see `Row.to_dict`) and a line for each frame.

    Unknown values (None, NaN) are left empty. The text is empty if there are no rows.
    """
    file = io.StringIO()
    table = csv.writer(file, lineterminator="\n")
    for k, row in enumerate(rows):
        values = row.to_dict()
        if k == 0:
            table.writerow(values)
        table.writerow(["" if _is_unknown(value) else value for value in values.values()])
    return file.getvalue()


def json_text(rows: Sequence[Row], settings: Mapping[str, Any]) -> str:
    """Return the results of an evaluation as JSON text (schema doo3d/evaluation/2).

    It holds the settings, a summary for each family and for "all", the reliability of the confidence (`ReliabilityBin`, for each
    bin, then for the 75 % most confident frames), and the row of every frame; unknown values are null.

    Parameters
    ----------
    rows
        a row for each frame.
    settings
        what was evaluated and how, such as families, seeds and sensor; stored as given.
    """
    groups = by_family(rows) | {"all": list(rows)}
    summaries = {name: summary(group).to_dict() for name, group in groups.items()}
    frames = [row.to_dict() for row in rows]
    curve = {"bins": [asdict(each) for each in reliability(rows)], "most_confident": asdict(most_confident_part(rows))}
    document = {"schema": SCHEMA, "settings": dict(settings), "summary": summaries, "reliability": curve, "frames": frames}
    return dumps(document)


def _is_unknown(value: Any) -> bool:
    return value is None or (isinstance(value, float) and not math.isfinite(value))


def _percent(correct: int, total: int) -> str:
    return f"{100 * correct / total:.1f} %" if total else "-"


def _share(correct: int, total: int, digits: int) -> str:
    return f"{correct}/{total} {100 * correct / total:.{digits}f} %" if total else "-"


def _number(value: float, digits: int) -> str:
    return f"{value:.{digits}f}" if math.isfinite(value) else "-"

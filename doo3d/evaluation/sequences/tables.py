"""Format the results of sequences as a text table, as CSV and as JSON."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping, Sequence
from typing import Any

from ...outputs.detection_json import dumps
from .rows import VARIANTS, SequenceResult, Summary, summary

SCHEMA = "doo3d/sequence-evaluation/1"

COLUMNS = (
    ("", "frames correct", 16),
    ("", "missing", 8),
    ("nodes", "mm", 7),
    ("hidden", "median", 7),
    ("hidden", "mean", 7),
    ("seen", "median", 7),
    ("RMS", "hidden", 7),
    ("jumps", "per 1000", 9),
    ("time", "ms", 7),
    ("of", "single", 7),
)
"""Two lines of a column's title, and its width in characters."""

_VARIANT_WIDTH = max(map(len, VARIANTS))


def format_table(results: Sequence[SequenceResult]) -> str:
    """Return a text table with a line for each sequence and variant, and one for each variant over all.

    The columns are:

    - frames correct: by the strict rule of Keipour et al. (RA-L 2022), of all frames;
    - missing: frames without any chain; they have no nodes;
    - nodes: mean distance of the nodes of the chains from their points of the material, mm;
    - hidden median, hidden mean: the same, of nodes where the sensor measured nothing, mm;
    - seen median: of the other nodes, mm;
    - RMS hidden: RMS distance of hidden parts from the true axis, median over frames, mm;
    - jumps per 1000: of 1,000 nodes, those that move more than 5 radii against the material since the frame before;
    - time ms, of single: processor time per frame, and as a multiple of that of single frames.

    A value that is unknown is shown as "-".
    """
    width = max([len("all"), *(len(result.name) for result in results)])
    lines = [
        " ".join([" " * (width + 1 + _VARIANT_WIDTH), *(f"{column[k]:>{column[2]}s}" for column in COLUMNS)]) for k in (0, 1)
    ]
    for result in results:
        lines += _lines(result.name, width, [result])
    if len(results) > 1:
        lines += ["-" * max(map(len, lines)), *_lines("all", width, results)]
    return "\n".join(lines)


def _lines(name: str, width: int, results: Sequence[SequenceResult]) -> list[str]:
    return [_line(name, width, variant, summary(results, variant)) for variant in VARIANTS]


def _line(name: str, width: int, variant: str, total: Summary) -> str:
    cells = (
        f"{total.frames_correct}/{total.frames} {100 * total.frames_correct / max(total.frames, 1):.1f} %",
        f"{total.frames_missing}",
        _number(total.node_error, 1),
        _number(total.hidden_median, 1),
        _number(total.hidden_mean, 1),
        _number(total.seen_median, 1),
        _number(total.rms_hidden, 1),
        _number(total.jumps, 1),
        _number(total.ms, 0),
        _number(total.time_ratio, 2),
    )
    values = [f"{cell:>{column[2]}s}" for cell, column in zip(cells, COLUMNS, strict=True)]
    return " ".join([f"{name:{width}s}", f"{variant:{_VARIANT_WIDTH}s}", *values])


def csv_text(results: Sequence[SequenceResult]) -> str:
    """Return CSV text: a line of column names (see `Row.to_dict`), then one per frame and variant; unknown values are empty."""
    file = io.StringIO()
    table = csv.writer(file, lineterminator="\n")
    rows = [row.to_dict() for result in results for row in result.rows]
    for k, row in enumerate(rows):
        if k == 0:
            table.writerow(row)
        table.writerow(["" if isinstance(value, float) and not math.isfinite(value) else value for value in row.values()])
    return file.getvalue()


def json_text(results: Sequence[SequenceResult], settings: Mapping[str, Any]) -> str:
    """Return the results as JSON text (schema doo3d/sequence-evaluation/1).

    It holds the settings; for each sequence its name, the true and the found length in m, and a summary of each variant; the
    summary of each variant over all sequences; and the row of every frame and variant. Unknown values are null.

    Parameters
    ----------
    results
        the results of the sequences.
    settings
        what was evaluated and how, such as motions, seeds and sensor; stored as given.
    """
    sequences = [
        {
            "name": result.name,
            "true_length": result.true_length,
            "found_length": result.found_length,
            "summary": {variant: summary([result], variant).to_dict() for variant in VARIANTS},
        }
        for result in results
    ]
    document = {
        "schema": SCHEMA,
        "settings": dict(settings),
        "summary": {variant: summary(results, variant).to_dict() for variant in VARIANTS},
        "sequences": sequences,
        "frames": [row.to_dict() for result in results for row in result.rows],
    }
    return dumps(document)


def _number(value: float, digits: int) -> str:
    return f"{value:.{digits}f}" if math.isfinite(value) else "-"

"""Format the scores of photographs as a table for people and as CSV."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from typing import Any

import numpy as np

from .evaluate import Row

_TIME_COLUMNS = (("ms", 7), ("95 %", 7), ("errors", 6))
_PHOTO_COLUMNS = (("images", 6), ("drawn", 7), ("labelled", 9), ("ordered", 8), ("count correct", 18), *_TIME_COLUMNS)
_CABLE_COLUMNS = (("cables", 6), ("traced", 18), ("recall", 7), ("precision", 9), *_TIME_COLUMNS)
_CSV_COLUMNS = (
    *("subset", "image", "cable", "cables", "chains", "drawn", "labelled", "ordered"),
    *("recall", "precision", "ms", "error", "code"),
)


def format_rows(rows: Sequence[Row]) -> str:
    """Return a text table with a line for each subset and one for all, followed by lists of errors and wrong results.

    All rows are photographs, or all are single cables. The columns for photographs: number of photographs; the three DICE scores
    of `PhotoScore` in %, "drawn", "labelled" and "ordered"; number of photographs with the right number of chains; median and
    95th percentile of the time in ms; number of errors.

    The columns for single cables: number of cables; cables traced (see `CableTrace.traced`); mean recall and precision
    in %; median and 95th percentile of the time in ms; number of errors.
    """
    single_cables = any(row.trace for row in rows)
    columns, cells = (_CABLE_COLUMNS, _cable_cells) if single_cables else (_PHOTO_COLUMNS, _photo_cells)
    subsets = sorted({row.ref.subset for row in rows})
    groups = {subset: [row for row in rows if row.ref.subset == subset] for subset in subsets}
    if len(groups) > 1:
        groups["all"] = list(rows)
    lines = [" ".join(["   ", *(f"{title:>{width}s}" for title, width in columns)])]
    for name, group in groups.items():
        values = zip(cells(group), columns, strict=True)
        lines.append(" ".join([f"{name:3s}", *(f"{cell:>{width}s}" for cell, (_, width) in values)]))
    for error, code in dict.fromkeys((row.error, row.code) for row in rows if row.error):
        lines.append(f"error: {error} [{code}]: {', '.join(row.name for row in rows if row.error == error)}")
    if wrong := [row for row in rows if not (row.score.count_correct or row.error or single_cables)]:
        counts = ", ".join(f"{row.name} {row.score.chains} of {row.score.cables}" for row in wrong)
        lines.append(f"count wrong: {counts}")
    if missed := [row.name for row in rows if row.trace and not (row.trace.traced or row.error)]:
        lines.append(f"not traced: {', '.join(missed)}")
    return "\n".join(lines)


def caption(row: Row) -> str:
    """Return a caption for the picture of a row, in one line: name, scores in %, and the error if there was one."""
    if row.trace:
        text = f"recall {100 * row.trace.recall:.1f}   precision {100 * row.trace.precision:.1f}"
    else:
        score = row.score
        dice = f"drawn {100 * score.drawn:.1f}   labelled {100 * score.labelled:.1f}   ordered {100 * score.ordered:.1f}"
        text = f"{dice}   {score.chains} of {score.cables} chains"
    return f"{row.name}   {text}" + (f"   {row.error}" if row.error else "")


def csv_text(rows: Sequence[Row]) -> str:
    """Return the rows as CSV text: a line of column names and a line for each row.

    Columns: subset, image, cable, cables, chains, drawn, labelled, ordered, recall, precision, ms, error, code. The scores are
    fractions, 0 to 1. Values that a row does not have are left empty; ms is nan after an error.
    """
    file = io.StringIO()
    table = csv.writer(file, lineterminator="\n")
    table.writerow(_CSV_COLUMNS)
    for row in rows:
        trace: list[Any] = [row.trace.recall, row.trace.precision] if row.trace else ["", ""]
        score = row.score
        values = [score.cables, score.chains, score.drawn, score.labelled, score.ordered]
        name = [row.ref.subset, row.ref.name, row.cable or ""]
        table.writerow([*name, *values, *trace, row.milliseconds, row.error or "", row.code or ""])
    return file.getvalue()


def _photo_cells(rows: Sequence[Row]) -> list[str]:
    scores = [row.score for row in rows]
    dice = [
        f"{100 * float(np.mean([getattr(score, kind) for score in scores])):.2f}" for kind in ("drawn", "labelled", "ordered")
    ]
    return [f"{len(rows)}", *dice, _share([score.count_correct for score in scores]), *_time_cells(rows)]


def _cable_cells(rows: Sequence[Row]) -> list[str]:
    traces = [row.trace for row in rows if row.trace]
    recall, precision = (100 * float(np.mean([getattr(trace, kind) for trace in traces])) for kind in ("recall", "precision"))
    return [f"{len(rows)}", _share([trace.traced for trace in traces]), f"{recall:.2f}", f"{precision:.2f}", *_time_cells(rows)]


def _time_cells(rows: Sequence[Row]) -> list[str]:
    times = [row.milliseconds for row in rows if not row.error]
    spread = [f"{np.percentile(times, percent):.1f}" for percent in (50, 95)] if times else ["-", "-"]
    return [*spread, f"{sum(row.error is not None for row in rows)}"]


def _share(correct: Sequence[bool]) -> str:
    return f"{sum(correct)}/{len(correct)} {100 * sum(correct) / len(correct):.1f} %"

"""Measure the expected run length: how far along a cable a trace stays right, as a fraction of the cable's length."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...types import Ints
from .observed import Observed
from .record import Column, Metric, Records, decimals


def run_squares(alongs: Sequence[Ints], cells: Sequence[float]) -> tuple[float, float]:
    """Return the sum over the cables of the squared lengths of right runs, and of the squared lengths of the cables.

    A run is a part of a cable with one number. Their ratio is the expected run length of Januszewski et al. (Nature Methods
    2018), as a fraction: the expected share of a cable, drawn by its length, that the run at a random place of it covers.

    Parameters
    ----------
    alongs
        for each cable the number of the run at each of its samples, (P,) int, 0 for none.
    cells
        for each cable the length of a sample.
    """
    counts = [np.bincount(along[along > 0]).astype(float) for along in alongs]
    runs = [float(cell**2 * (count**2).sum()) for count, cell in zip(counts, cells, strict=True)]
    return sum(runs), sum(float((cell * len(along)) ** 2) for along, cell in zip(alongs, cells, strict=True))


def measure(match: Observed) -> dict[str, Any]:
    """Return the sums of the squared lengths in m^2 of right runs and of the cables.

    A run is a stretch of a chain along one cable, in one direction and without a jump. A chain counts only for the cable that it
    follows longest, since it is a merge on all others. Where chains follow a cable twice, the longer run counts.
    """
    alongs = [np.zeros(len(truth.axis), dtype=int) for truth in match.truths]
    runs = []
    for alignment in match.alignments:
        lengths = np.zeros(len(alongs))
        for stretch in alignment.stretches:
            lengths[stretch.cable] += np.ptp(stretch.arcs)
        runs += [stretch for stretch in alignment.stretches if stretch.cable == lengths.argmax()]
    for number, run in enumerate(sorted(runs, key=lambda run: float(np.ptp(run.arcs))), start=1):
        truth = match.truths[run.cable]
        first, last = np.round(np.array((run.arcs.min(), run.arcs.max())) / truth.spacing).astype(int)
        index = np.arange(first, min(last, first + len(truth.axis) - 1) + 1)
        alongs[run.cable][index % len(truth.axis) if truth.closed else np.clip(index, 0, len(truth.axis) - 1)] = number
    return dict(zip(("run_squares", "cable_squares"), run_squares(alongs, [t.spacing for t in match.truths]), strict=True))


def _summary(rows: Records) -> dict[str, Any]:
    total = sum(row.cable_squares for row in rows)
    return {"run_length": sum(row.run_squares for row in rows) / total if total else float("nan")}


RUN_LENGTH = Column(("run", "length"), 7, _summary, lambda values: decimals(100 * values["run_length"], 1))
"""Column of the expected run length, in % of the cables' length."""

METRIC = Metric(measure, (RUN_LENGTH,))

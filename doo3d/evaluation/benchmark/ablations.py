"""What each means of the method is worth: the same frames again and again, with one of them turned off at a time."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from ...config import Config
from .cases import Case
from .evaluate import detected
from .rows import Row, by_family, summary

DEFAULT = "everything on"
ABLATIONS: dict[str, dict[str, object]] = {
    DEFAULT: {},
    "what the camera saw through does not count": {"merge.free_space_weight": 0},
    "nor does what it did not see": {"merge.free_space_weight": 0, "merge.unknown_weight": 0},
    "connections one by one, the cheapest first": {"merge.strategy": "greedy"},
    "ends point as their last segment does": {"merge.direction_length": 0},
    "ends are not expected to keep bending": {"merge.keep_bending": 0},
    "paths not cut back at junctions": {"traverse.separation": 0},
    "voxels from the whole width of the strands": {"voxelize.core": 0},
    "voxels from single depth readings": {"segment.smooth": False},
    "the chain stays on the seen surface": {"refine.rounds": 0},
    "the axis is not smoothed": {"refine.smooth": 0},
    "depth counts as much as sideways": {"refine.depth_weight": 1},
}


def ablate(
    cases: Sequence[Case], variants: Mapping[str, Config], report: Callable[[Row], None] = lambda row: None
) -> dict[str, list[Row]]:
    """The rows of each variant over the same cases, each rendered or read once; the number of cables and the mask are given."""
    rows: dict[str, list[Row]] = {name: [] for name in variants}
    for case in cases:
        there = case.load()
        for name, config in variants.items():
            rows[name].append(detected(case, there, config))
        report(rows[next(iter(variants))][-1])
    return rows


def format_ablations(rows: Mapping[str, Sequence[Row]]) -> str:
    """A line per variant: frames correct per family and in all, occlusions, and medians of distances."""
    families = list(by_family(next(iter(rows.values()))))
    wide = max(map(len, rows))
    columns = [(name, max(7, len(name))) for name in (*families, "all")]
    columns += [("occlusions", 10), ("wrong", 6), ("RMS seen", 9), ("hidden", 7)]
    lines = [" ".join([" " * wide, *(f"{name:>{width}s}" for name, width in columns)])]
    for name, own in rows.items():
        groups, total = by_family(own), summary(own)
        cells = [_share([row.score.correct for row in group]) for group in (*groups.values(), own)]
        cells += [f"{total.occlusions_correct}/{total.occlusions}", f"{total.connections - total.connections_correct}"]
        cells += [f"{total.rms_seen:.2f}", f"{total.rms_hidden:.2f}"]
        lines.append(
            " ".join([f"{name:{wide}s}", *(f"{cell:>{width}s}" for cell, (_, width) in zip(cells, columns, strict=True))])
        )
    return "\n".join(lines)


def _share(good: Sequence[bool]) -> str:
    return f"{sum(good)}/{len(good)}"

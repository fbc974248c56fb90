"""The bill of the method: what each step gives, and what it costs.

Each step is taken out alone, by a setting or by putting something that does nothing in its place, on the same frames. A row tells
how many frames become right and wrong by the step, whether that may be chance, and how long the step takes in ms, lines and
numbers. Frames in which the step is not called are not run again.
"""

from __future__ import annotations

import importlib
import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from types import FunctionType
from typing import Any, NamedTuple

import numpy as np
from scipy.special import logit

from ...stages.confidence.evidence import TOLD
from ..metrics.record import Record
from .source_size import SourceSize, size_of
from .trials import Outcome, Run, Trial

_STAGES = "doo3d.stages"


@dataclass(frozen=True)
class Ablation:
    """How one step of the method is taken out.

    Attributes
    ----------
    settings
        dotted key of the config -> value, such as "merge.strategy" -> "greedy".
    places
        "module:NAME" in the source code -> what is put there: a function that does nothing, or a value of a constant.
    modules
        modules in `doo3d` that go with the step, whose lines and numbers are its price.
    made_for
        kinds of data (keys of `trials.KINDS`) that the step was made for; the row is for them, beside that for all.
    """

    settings: Mapping[str, Any] = field(default_factory=dict)
    places: Mapping[str, Any] = field(default_factory=dict)
    modules: tuple[str, ...] = ()
    made_for: tuple[str, ...] = ("frames", "stereo", "ragged")


def _first(value: Any, *_: Any) -> Any:
    """Return the first argument: in place of a function that changes it."""
    return value


def _no_split(facts: Any, *_: Any) -> Any:
    from ...stages.segment.split_strands import SplitMask

    return SplitMask(facts.mask, 0, None)


def _no_hues(facts: Any, color: Any) -> Any:
    return None


def _no_strand_filter(readings: Any, *_: Any) -> Any:
    return readings, 0


def _nothing_beside(value: Any, known: Any, surface: Any, *rest: Any) -> Any:
    from ...kernels import smooth_strand_depth

    return smooth_strand_depth(value, known, surface[:0], *rest)


def _no_runs(value: Any, known: Any, surface: Any, radius: float, focal: float, numbers: Any, *rest: Any) -> Any:
    """Return the curve that starts from all readings where that from the running median is wrong: no step is a jump."""
    from ...kernels import smooth_strand_depth

    return smooth_strand_depth(
        value, known, surface, radius, focal, np.where(np.arange(len(numbers)) == 8, np.inf, numbers), *rest
    )


def _readings_alone(readings: Any, *rest: Any) -> Any:
    from ...stages.segment.strand_filter import filter_along_strands

    filtered, count = filter_along_strands(readings, *rest)
    given = {tuple(pixel) for pixel in readings.pixels.tolist()}
    kept = np.array([tuple(pixel) in given for pixel in filtered.pixels.tolist()], dtype=bool)
    return readings._replace(depth=filtered.depth[kept], filtered=filtered.filtered[kept]), count


def _all(_: Any, pixels: Any, *__: Any) -> Any:
    return np.ones(len(pixels), dtype=bool)


def _none(*_: Any, **__: Any) -> None:
    return None


def _nothing(*_: Any, **__: Any) -> list[Any]:
    return []


class _NoSupport:
    beside = staticmethod(_none)


def _confidence_without(kind: str) -> Ablation:
    weights = {name: 0.0 if name == kind else weight for name, weight in TOLD.items()}
    return Ablation(places={f"{_STAGES}.confidence.evidence:TOLD": weights}, made_for=("frames", "stereo", "ragged", "images"))


DEPTH = ("stereo", "ragged")
BRANCHED = ("harnesses",)
ABLATIONS: dict[str, Ablation] = {
    "mask repair": Ablation(
        places={f"{_STAGES}.segment.segment:repair_mask": lambda mask, _: (mask, None)},
        modules=("stages.segment.mask_repair",),
        made_for=("ragged", "untold"),
    ),
    "parts judged by a network": Ablation(
        {"segment.method": "strands"}, modules=("stages.segment.judged_parts",), made_for=("untold",)
    ),
    "bands of many widths told by a network": Ablation(
        places={f"{_STAGES}.segment.color_strands:_with_probable": lambda parts, _: (parts, parts.strands)}, made_for=("untold",)
    ),
    "surface learned outside of bands": Ablation(
        places={f"{_STAGES}.segment.color_strands:_told_again": _none}, made_for=("untold",)
    ),
    "color where nothing broad has depth": Ablation(
        places={f"{_STAGES}.segment.methods.strands:is_broad": lambda *_: True}, made_for=("untold",)
    ),
    "colors vote in photographs": Ablation(
        places={f"{_STAGES}.segment.methods.network:_with_colors": lambda probability, _: logit(probability)},
        made_for=("photographs",),
    ),
    "strands side by side are not wide": Ablation(
        places={f"{_STAGES}.segment.mask_cleanup:_bundles": lambda mask, *_: np.zeros_like(mask)}, made_for=("untold",)
    ),
    "split strands": Ablation(
        places={f"{_STAGES}.segment.segment:split_strands": _no_split},
        modules=tuple(f"stages.segment.{name}" for name in ("split_strands", "valleys", "valley_lines", "wide_stretches")),
    ),
    "strand hues": Ablation(
        places={f"{_STAGES}.segment.split_strands:_split_colors": _no_hues},
        modules=("evidence.strand_hues",),
        made_for=("images",),
    ),
    "strand filter": Ablation(
        places={f"{_STAGES}.segment.segment:filter_along_strands": _no_strand_filter},
        modules=("stages.segment.strand_filter",),
        made_for=DEPTH,
    ),
    "strand filter: drawn to the surface": Ablation(
        places={f"{_STAGES}.segment.strand_filter:_drawn_to_surface": _first}, made_for=DEPTH
    ),
    "strand filter: runs of readings": Ablation(
        places={f"{_STAGES}.segment.strand_filter:smooth_strand_depth": _no_runs}, made_for=DEPTH
    ),
    "strand filter: what lies behind is told by what is beside": Ablation(
        places={f"{_STAGES}.segment.strand_filter:smooth_strand_depth": _nothing_beside}, made_for=DEPTH
    ),
    "strand filter: all pixels of a smoothed strand": Ablation(
        places={f"{_STAGES}.segment.segment:filter_along_strands": _readings_alone}, made_for=DEPTH
    ),
    "outliers of depth": Ablation(places={f"{_STAGES}.segment.depth_filter:OUTLIER_MIN_NEIGHBORS": 0}),
    "inpainting of depth": Ablation(
        places={f"{_STAGES}.segment.segment:inpaint_readings": _first}, modules=("stages.segment.depth_inpainting",)
    ),
    "sparse strands": Ablation(
        places={f"{_STAGES}.segment.segment:find_sparse_strands": _none},
        modules=("stages.segment.sparse_strands",),
        made_for=("lines",),
    ),
    "voxels along the rays": Ablation(
        places={f"{_STAGES}.voxelize:_along_rays": _first, f"{_STAGES}.voxelize:_in_space": _first}, made_for=DEPTH
    ),
    "voxels of the core alone": Ablation({"voxelize.core_fraction": 0}),
    "voxels of middle lines between touching strands": Ablation(places={f"{_STAGES}.voxelize:middle_pixels": _all}),
    "cut at occluding edges": Ablation({"voxelize.split_at_depth_step": 0}),
    "spurs": Ablation({"traverse.min_branch": 0}),
    "small loops": Ablation(places={f"{_STAGES}.traverse.traverse:MIN_LOOP_RADII": 0.0}),
    "forks of a crossing united": Ablation(places={f"{_STAGES}.traverse.traverse:JUNCTION_MERGE_DISTANCE_RADII": 0.0}),
    "paths cut back at junctions": Ablation(places={f"{_STAGES}.traverse.traverse:TOUCHING_RADII": 0.0}),
    "gaps along which the object is seen": Ablation(
        places={f"{_STAGES}.links.candidates:seen_gaps": lambda *_: {}}, modules=("stages.links.seen",), made_for=DEPTH
    ),
    "curvature persistence": Ablation({"merge.curvature_persistence": 0}),
    "cost of bends": Ablation({"merge.direction_weight": 0, "merge.curvature_weight": 0}),
    "cost of free space": Ablation({"merge.free_space_weight": 0}),
    "all connections decided together": Ablation({"merge.strategy": "greedy"}),
    "bare surface": Ablation(
        places={"doo3d.evidence.depth_model:Support": _NoSupport},
        modules=("evidence.support",),
        made_for=("stereo", "ragged", "images"),
    ),
    "ends extended to the surface": Ablation(places={f"{_STAGES}.refine.refine:extend_to_surface": _first}),
    "second iteration of the axis": Ablation({"refine.iterations": 1}),
    "smoothing of the axis": Ablation(places={f"{_STAGES}.refine.axis_and_radius:SMOOTHING_RADII": 0.0}),
    "depth weighs less than the mask": Ablation(places={f"{_STAGES}.refine.axis_and_radius:DEPTH_WEIGHT": 1.0}),
    "axis raised out of the plane": Ablation(places={f"{_STAGES}.refine.axis_and_radius:MAX_SUNK_RADII": 0.0}, made_for=DEPTH),
    "mask extended along strands": Ablation({"extend_mask.max_length": 0}, modules=("stages.extend_mask",), made_for=("images",)),
    "upper strand by depth": Ablation(places={f"{_STAGES}.crossings.upper_strand:depth_log_odds": lambda *_: 0.0}),
    "upper strand by color": Ablation(places={f"{_STAGES}.crossings.upper_strand:color_log_odds": lambda *_: 0.0}),
    "other interpretations of uncertain frames": Ablation(
        places={f"{_STAGES}.confidence.interpretations:OTHERS": ()},
        modules=("stages.confidence.interpretations",),
        made_for=DEPTH,
    ),
    "branching ends are not linked": Ablation(
        places={f"{_STAGES}.links.terms.branching:BRANCH_COST": math.inf},
        modules=("stages.links.terms.branching",),
        made_for=BRANCHED,
    ),
    "bodies": Ablation(
        places={f"{_STAGES}.branches.branches:body_meetings": _nothing}, modules=("stages.branches.bodies",), made_for=BRANCHED
    ),
    "necks": Ablation(
        places={f"{_STAGES}.branches.attachments:NECK_COST": 0.0}, modules=("stages.branches.necks",), made_for=BRANCHED
    ),
    "joins across gaps of a branched cloud": Ablation(
        places={f"{_STAGES}.branches.branches:end_joins": _nothing}, modules=("stages.branches.clouds",), made_for=BRANCHED
    ),
    **{f"confidence by {kind}": _confidence_without(kind) for kind in TOLD if kind != "base"},
}
"""Name of a step -> how it is taken out."""


class Bill(NamedTuple):
    """What a step gives on one or more kinds of data. Changes are by the step: with it against without it.

    Attributes
    ----------
    frames
        frames tried.
    gained, lost
        frames that the step makes right, and wrong, by the strict rule.
    gained_in_image, lost_in_image
        the same in the image.
    crossings_gained
        crossings whose upper strand is right by the step, less those that are wrong by it.
    brier
        change of the mean squared difference of confidence and rightness in the image; less is better.
    ms
        mean time of the step.
    """

    frames: int
    gained: int
    lost: int
    gained_in_image: int
    lost_in_image: int
    crossings_gained: int
    brier: float
    ms: float

    @property
    def chance(self) -> float:
        """The chance of so uneven a change, strict and in the image together, if the step did nothing: a sign test."""
        return sign_test(self.gained + self.gained_in_image, self.lost + self.lost_in_image)


def sign_test(gained: int, lost: int) -> float:
    """Return the chance that of so many changes at least as many go one way, if both are equally likely: two-sided, 0 to 1."""
    changes = gained + lost
    tail: float = sum(math.comb(changes, k) for k in range(max(gained, lost), changes + 1)) / 2**changes
    return min(1.0, 2 * tail)


@contextmanager
def replaced(places: Mapping[str, Any]) -> Iterator[None]:
    """Put functions or constants in the source code's places inside a `with` block, and the former ones back at its end.

    Parameters
    ----------
    places
        "module:NAME" -> value.

    Raises
    ------
    ImportError : there is no such module.
    AttributeError : a module has no such name.
    """
    found = [(importlib.import_module(module), name) for module, _, name in (key.partition(":") for key in places)]
    before = [getattr(module, name) for module, name in found]
    try:
        for (module, name), value in zip(found, places.values(), strict=True):
            setattr(module, name, value)
        yield
    finally:
        for (module, name), value in zip(found, before, strict=True):
            setattr(module, name, value)


Result = tuple[Trial, Outcome, dict[str, Outcome]]
"""A frame, what the whole method came to, and for each step what it came to without it."""


def run_ablations(trial: Trial, steps: Sequence[str]) -> Result:
    """Detect in a frame with all steps, and then without one at a time.

    Parameters
    ----------
    trial
        the frame; it is rendered or read once.
    steps
        keys of ABLATIONS.

    Raises
    ------
    ConfigError : a setting of a step is invalid.
    """
    run = trial.load()
    called: set[str] = set()
    with replaced(_listening(steps, called)):
        run({})  # not timed; tells which functions are called
    complete = run({})
    return trial, complete, {name: _without(ABLATIONS[name], run, complete, called) for name in steps}


def _without(ablation: Ablation, run: Run, complete: Outcome, called: set[str]) -> Outcome:
    """Return the outcome without a step: that with it, if the frame does not call the functions of the step."""
    if ablation.places and not ablation.settings and not called.intersection(ablation.places):
        return complete
    with replaced(ablation.places):
        return run(dict(ablation.settings))


def _listening(steps: Sequence[str], called: set[str]) -> dict[str, Any]:
    """Return for each function that a step replaces one that calls it and notes that it was called; constants always are."""

    def noting(place: str, function: Any) -> Any:
        def call(*args: Any, **kwargs: Any) -> Any:
            called.add(place)
            return function(*args, **kwargs)

        return call

    found: dict[str, Any] = {}
    for place in sorted({place for name in steps for place in ABLATIONS[name].places}):
        module, _, name = place.partition(":")
        value = getattr(importlib.import_module(module), name)
        if isinstance(value, FunctionType):
            found[place] = noting(place, value)
        else:
            called.add(place)
    return found


def bill_of(results: Sequence[Result], step: str, kinds: Sequence[str] = ()) -> Bill:
    """Return what a step gives on the frames of some kinds of data; of all without any."""
    pairs = [(complete, without[step]) for trial, complete, without in results if not kinds or trial.kind in kinds]

    def changes(name: str) -> tuple[int, int]:
        each = [(getattr(complete, name), getattr(without, name)) for complete, without in pairs]
        return sum(a and not b for a, b in each), sum(b and not a for a, b in each)

    squared = [(a.confidence - a.in_image) ** 2 - (b.confidence - b.in_image) ** 2 for a, b in pairs]
    return Bill(
        len(pairs),
        *changes("right"),
        *changes("in_image"),
        sum(complete.crossings_right - without.crossings_right for complete, without in pairs),
        float(np.mean(squared)) if pairs else 0.0,
        float(np.mean([complete.ms - without.ms for complete, without in pairs])) if pairs else 0.0,
    )


def rows_of(results: Sequence[Result], steps: Sequence[str]) -> list[Record]:
    """Return two flat rows for each step, on the data that it was made for and on all, ready for a table, CSV and JSON."""
    rows = []
    for step in steps:
        ablation = ABLATIONS[step]
        size = size_of(ablation.modules) if ablation.modules else SourceSize(0, 0)
        for data, kinds in (("own", ablation.made_for), ("all", ())):
            bill = bill_of(results, step, kinds)
            own = {"lines": size.lines, "numbers": size.numbers}
            rows.append(Record({"step": step, "data": data, **bill._asdict(), "chance": round(bill.chance, 4), **own}))
    return rows


def format_ablations(rows: Sequence[Mapping[str, Any]]) -> str:
    """Return the bill as a text table: a line for each step on its own data, and one on all."""
    titles = ("frames", "strict", "in image", "chance", "crossings", "Brier", "ms", "lines", "numbers")
    width = max(len(row["step"]) for row in rows)
    lines = [f"{'step':{width}s} data " + " ".join(f"{title:>9s}" for title in titles)]
    for row in rows:
        cells = (
            str(row["frames"]),
            f"+{row['gained']} -{row['lost']}",
            f"+{row['gained_in_image']} -{row['lost_in_image']}",
            f"{row['chance']:.3f}",
            f"{row['crossings_gained']:+d}",
            f"{row['brier']:+.4f}",
            f"{row['ms']:+.1f}",
            str(row["lines"] or ""),
            str(row["numbers"] or ""),
        )
        lines.append(
            f"{row['step'] if row['data'] == 'own' else '':{width}s} {row['data']}  " + " ".join(f"{c:>9s}" for c in cells)
        )
    return "\n".join(lines)

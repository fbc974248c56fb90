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
from types import FunctionType
from typing import Any, NamedTuple

import numpy as np

from ..metrics.record import Record
from .source_size import SourceSize, size_of
from .steps import ABLATIONS, Ablation
from .trials import Outcome, Run, Trial


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

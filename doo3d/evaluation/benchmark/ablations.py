"""The bill of the method: what each step gives, and what it costs.

Each step is taken out alone, by a setting or by putting something that does nothing in its place, on the same frames. A row tells
how many frames become right and wrong by the step, whether that may be chance, and how long the step takes in ms, lines and
numbers. Frames in which the step is not called are not run again.
"""

from __future__ import annotations

import importlib
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from types import FunctionType
from typing import Any

import numpy as np

from ..metrics.record import Record
from .source_size import size_of
from .steps import ABLATIONS, Ablation
from .trials import Outcome, Run, Trial


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


def changed(complete: Iterable[Any], without: Iterable[Any], name: str) -> tuple[int, int]:
    """Return the numbers of frames that have a value by a step, and that have lost it by the step.

    complete, without : outcomes with and without the step, frame by frame. name : of a true or false value.
    """
    pairs = [(bool(getattr(a, name)), bool(getattr(b, name))) for a, b in zip(complete, without, strict=True)]
    return sum(a > b for a, b in pairs), sum(b > a for a, b in pairs)


def bill_of(results: Sequence[Result], step: str, kinds: Sequence[str] = ()) -> Record:
    """Return what a step gives on the frames of some kinds of data; of all without any.

    Changes are by the step: with it against without it.

    Returns
    -------
    Record
        frames: those tried. gained, lost: frames that the step makes right, and wrong, by the strict rule; gained_in_image,
        lost_in_image: the same in the image. crossings_gained: crossings whose upper strand is right by the step, less those that
        are wrong by it. brier: change of the mean squared difference of confidence and rightness in the image; less is better.
        ms: mean time of the step. chance: of so uneven a change, strict and in the image together, if the step did nothing.
    """
    pairs = [(complete, without[step]) for trial, complete, without in results if not kinds or trial.kind in kinds]
    first, second = [a for a, _ in pairs], [b for _, b in pairs]
    (gained, lost), (in_image, lost_in_image) = (changed(first, second, name) for name in ("right", "in_image"))
    squared = [(a.confidence - a.in_image) ** 2 - (b.confidence - b.in_image) ** 2 for a, b in pairs]
    return Record(
        frames=len(pairs),
        gained=gained,
        lost=lost,
        gained_in_image=in_image,
        lost_in_image=lost_in_image,
        crossings_gained=sum(a.crossings_right - b.crossings_right for a, b in pairs),
        brier=float(np.mean(squared or [0.0])),
        ms=float(np.mean([a.ms - b.ms for a, b in pairs] or [0.0])),
        chance=round(sign_test(gained + in_image, lost + lost_in_image), 4),
    )


def rows_of(results: Sequence[Result], steps: Sequence[str]) -> list[Record]:
    """Return two flat rows for each step, on the data that it was made for and on all, ready for a table, CSV and JSON."""
    rows = []
    for step in steps:
        ablation = ABLATIONS[step]
        size = size_of(ablation.modules)._asdict()
        for data, kinds in (("own", ablation.made_for), ("all", ())):
            rows.append(Record({"step": step, "data": data} | bill_of(results, step, kinds) | size))
    return rows


CELLS = {
    "frames": "{frames}",
    "strict": "+{gained} -{lost}",
    "in image": "+{gained_in_image} -{lost_in_image}",
    "chance": "{chance:.3f}",
    "crossings": "{crossings_gained:+d}",
    "Brier": "{brier:+.4f}",
    "ms": "{ms:+.1f}",
    "lines": "{lines}",
    "numbers": "{numbers}",
}
"""Title of a column of the bill -> text of its cells, from the values of a row."""


def format_ablations(rows: Sequence[Mapping[str, Any]]) -> str:
    """Return the bill as a text table: a line for each step on its own data, and one on all."""
    width = max(len(row["step"]) for row in rows)
    lines = [f"{'step':{width}s} data " + " ".join(f"{title:>9s}" for title in CELLS)]
    for row in rows:
        shown = {**row, "lines": row["lines"] or "", "numbers": row["numbers"] or ""}
        cells = " ".join(f"{cell.format(**shown):>9s}" for cell in CELLS.values())
        lines.append(f"{row['step'] if row['data'] == 'own' else '':{width}s} {row['data']}  {cells}")
    return "\n".join(lines)

"""Measure the benefit and the cost of each step of the method, by detecting without it (an ablation study).

Each step is removed alone, by a setting or by a replacement that does nothing, on the same frames. A row of the table gives the
numbers of frames that the step makes right and wrong, the probability that this difference is chance, and the cost of the step:
ms, lines of code and typed numbers. Frames in which the step is not called are not run again.
"""

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
    """Return the p-value, 0 to 1, of a two-sided sign test on numbers of frames gained and lost."""
    changes = gained + lost
    tail: float = sum(math.comb(changes, k) for k in range(max(gained, lost), changes + 1)) / 2**changes
    return min(1.0, 2 * tail)


@contextmanager
def replaced(places: Mapping[str, Any]) -> Iterator[None]:
    """Replace functions or constants of modules inside a `with` block, and restore them at its end.

    Parameters
    ----------
    places
        "module:NAME" -> the function or value to use instead.

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
"""A frame; the outcome with all steps; name of each step -> the outcome without this step."""


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
    """Return the outcome without a step; without a new run if this frame did not call the functions of the step."""
    if ablation.places and not ablation.settings and not called.intersection(ablation.places):
        return complete
    with replaced(ablation.places):
        return run(dict(ablation.settings))


def _listening(steps: Sequence[str], called: set[str]) -> dict[str, Any]:
    """Return a wrapper for each function that a step replaces, which records in `called` that the step was used.

    Steps that replace a constant always count as used.
    """

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
    """Return the numbers of frames in which a step turns a boolean value true, and false.

    complete, without : outcomes with and without the step, frame by frame. name : attribute of the outcomes, such as "right".
    """
    pairs = [(bool(getattr(a, name)), bool(getattr(b, name))) for a, b in zip(complete, without, strict=True)]
    return sum(a > b for a, b in pairs), sum(b > a for a, b in pairs)


def bill_of(results: Sequence[Result], step: str, kinds: Sequence[str] = ()) -> Record:
    """Return the benefit and the time of a step on the frames of some kinds of data; on all frames if none is named.

    A change is the outcome with the step compared with that without it.

    Returns
    -------
    Record
        frames: number of frames. gained, lost: frames that the step makes right, and wrong, by the strict rule; gained_in_image,
        lost_in_image: the same in the image. crossings_gained: crossings whose upper strand the step makes right, minus those
        that it makes wrong. brier: change of the Brier score, the mean squared difference between the confidence and 1 (right in
        the image) or 0; negative is better. ms: mean time of the step. chance: p-value of the sign test over the strict changes
        and those in the image together.
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
    """Return two records for each step, one on the data that it was made for and one on all data."""
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
"""Title of each column of the table -> format of its cells, filled with the values of a row."""


def format_ablations(rows: Sequence[Mapping[str, Any]]) -> str:
    """Return the rows of `rows_of` as a text table: two lines for each step."""
    width = max(len(row["step"]) for row in rows)
    lines = [f"{'step':{width}s} data " + " ".join(f"{title:>9s}" for title in CELLS)]
    for row in rows:
        shown = {**row, "lines": row["lines"] or "", "numbers": row["numbers"] or ""}
        cells = " ".join(f"{cell.format(**shown):>9s}" for cell in CELLS.values())
        lines.append(f"{row['step'] if row['data'] == 'own' else '':{width}s} {row['data']}  {cells}")
    return "\n".join(lines)

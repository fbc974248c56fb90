"""Measure the benefit of each step of tracking: `python -m doo3d.evaluation.sequences.ablations`.

The frames of a sequence are detected once, and combined with all steps and without one at a time.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from time import process_time
from typing import Any, NamedTuple

import numpy as np

from ...config import Config, load_config
from ...track.detect_sequence import combine
from ...track.shape import Shape
from ...types import Bools, Floats
from ..benchmark.ablations import changed, replaced
from ..benchmark.run import print_lines
from ..metrics.record import Record
from .evaluate import HIDDEN, JUMPS, FirstPass, first_pass, variant_rows
from .recorded import RecordedSequence, recorded_sequences
from .scenes import Sequence as TrueSequence
from .scenes import make_sequence

_PLACE = "doo3d.track"


def _first(value: Any, *_: Any) -> Any:
    """Return the first argument unchanged; it replaces functions that would change it."""
    return value


def _never(*_: Any) -> bool:
    """Return False; it replaces functions that test a condition."""
    return False


def _all_apart(skipped: Floats, *_: Any) -> Bools:
    """Return True for every cut; it replaces the function that selects those that count."""
    return np.ones(len(skipped), dtype=bool)


def _all_measured(chains: Sequence[Any]) -> tuple[Floats, Floats]:
    """Return the lengths of chains, as if each was measured over its whole length."""
    lengths = np.array([chain.length for chain in chains])
    return lengths, np.zeros_like(lengths)


def _nearer_fit(_: Any, forward: Sequence[Shape | None], backward: Sequence[Shape | None]) -> list[bool]:
    """Return for each frame whether its shape from earlier frames fits better than that from later ones."""
    pairs = zip(forward, backward, strict=True)
    return [before is not None and after is not None and before.cost <= after.cost for before, after in pairs]


STEPS: dict[str, Mapping[str, Any]] = {
    "lengths by what was measured": {f"{_PLACE}.tracks:lengths_of": _all_measured, f"{_PLACE}.tracks:FILLED_ERROR": 0.0},
    "lengths by chains with two tips": {f"{_PLACE}.tracks:CUT_OFF": math.inf},
    "objects that most frames show, none surely": {f"{_PLACE}.objects:_most_show": _never},
    "sure chains of an object in one direction": {f"{_PLACE}.tracks:MIN_JOINED_CONFIDENCE": math.inf},
    "strands cut where joined wrongly": {f"{_PLACE}.frame_evidence:cut_misjoined": _first},
    "strands of a wrong length are not cut": {f"{_PLACE}.strand_cutting:_are_apart": _all_apart},
    "both passes decided together": {f"{_PLACE}.follow:_prefer_forward": _nearer_fit},
    "and less where it moves along the line of sight": {f"{_PLACE}.inverse_range_smoother:_relax_stiffness": _first},
    "places smoothed over time": {f"{_PLACE}.shape_smoothing:whittaker_smooth": _first},
    "depth of the object smoothed over time": {f"{_PLACE}.shape_smoothing:smooth_joint_depth": _first},
}
"""Name of a step -> "module:NAME" in the source code -> its replacement."""


class Outcome(NamedTuple):
    """The records of the frames of one or more sequences, and the processor time of combining them, s."""

    rows: list[Record]
    seconds: float


def outcomes_of(frames: Sequence[FirstPass], config: Config, steps: Sequence[str]) -> dict[str, Outcome]:
    """Return the outcome of a sequence with all steps, named "", and without each of the given steps."""
    result = {}
    for step in ("", *steps):
        with replaced(STEPS.get(step, {})):
            start = process_time()
            detections = list(combine([frame.observation for frame in frames], config))
            seconds = process_time() - start
        result[step] = Outcome(variant_rows("sequence", frames, detections), seconds)
    return result


def table(sequences: Sequence[tuple[TrueSequence | RecordedSequence, str]], steps: Sequence[str]) -> Iterator[str]:
    """Yield the lines of a Markdown table of the benefit of each step; sequences : each with the name of its sensor.

    A cell "+3 -1" counts the frames that the step makes right and wrong; "hidden" and "jumps" are values with and without the
    step.
    """
    config = load_config("default", {"merge.chains": 1})
    found: dict[str, Outcome] = {step: Outcome([], 0.0) for step in ("", *steps)}
    for sequence, sensor in sequences:
        frames = [first_pass(rendered, config) for rendered in sequence.frames(sensor)]
        for step, (rows, seconds) in outcomes_of(frames, config, steps).items():
            found[step] = Outcome(found[step].rows + rows, found[step].seconds + seconds)
    complete = found.pop("")
    count = len(complete.rows)
    yield f"| of {count} frames | right | in the image | hidden, mean | jumps per 1,000 | ms a frame |"
    yield "|---|---|---|---|---|---|"
    for step, without in found.items():
        counts = [changed(complete.rows, without.rows, key) for key in ("correct", "image_correct")]
        changes = " | ".join(f"+{gained} -{lost}" for gained, lost in counts)
        both = [[column.text(column.summarize(each.rows)) for each in (complete, without)] for column in (HIDDEN, JUMPS)]
        hidden, jumps = map(" for ".join, both)
        yield f"| {step} | {changes} | {hidden} mm | {jumps} | {1e3 * (complete.seconds - without.seconds) / count:+.1f} |"


def main(
    own: str = "dragged,knot",
    seeds: int = 6,
    start: int = 2,
    frames: int = 60,
    motions: list[Path] | None = None,
    sensor: str = "d435",
    width: int = 640,
    captures: list[Path] | None = None,
) -> Iterator[str]:
    """Measure tracking without each of its steps, and yield the lines of a table.

    own : names of motions that need no file, separated by commas; may be empty. seeds, start : number of sequences of each
    motion, and first seed. frames : number per sequence, 30 per second. motions : file of motion capture; repeat for more.
    sensor, width : simulated camera, and width of its images in px, which are 480 px high. captures : folder of captures with
    truth.npz; repeat for more.
    """
    names: list[str | Path] = [*([] if own == "none" else own.split(",")), *(motions or [])]
    chosen: list[tuple[TrueSequence | RecordedSequence, str]] = [
        (make_sequence(motion, seed, (width, 480), frames), sensor) for motion in names for seed in range(start, start + seeds)
    ]
    chosen += [(capture, "") for capture in recorded_sequences(captures or [], frames)]
    return table(chosen, list(STEPS))


if __name__ == "__main__":
    print_lines(main)

"""Measure the benefit of each step of tracking: `python -m doo3d.evaluation.sequences.ablations`.

The frames of a sequence are detected once, and combined with all steps and without one at a time.
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from time import process_time
from typing import Any, NamedTuple

import numpy as np

from ...config import Config, load_config
from ...track.detect_sequence import combine
from ...track.shape import Shape
from ...types import Floats
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


def _zero(*_: Any) -> float:
    """Return 0; it replaces functions that return a cost."""
    return 0.0


def _none(*_: Any) -> list[Any]:
    """Return an empty list; it replaces functions that return what they found."""
    return []


def _all_measured(chains: Sequence[Any]) -> tuple[Floats, Floats]:
    """Return the lengths of chains, as if each was measured over its whole length."""
    lengths = np.array([chain.length for chain in chains])
    return lengths, np.zeros_like(lengths)


def _cheapest(hypotheses: Sequence[Sequence[Shape]], _: float) -> list[Shape | None]:
    """Return the hypothesis of least cost in each frame by itself."""
    return [min(shapes, key=lambda shape: shape.cost, default=None) for shapes in hypotheses]


STEPS: dict[str, Mapping[str, Any]] = {
    "lengths by what was measured": {f"{_PLACE}.tracks:lengths_of": _all_measured, f"{_PLACE}.object_length:FILLED_ERROR": 0.0},
    "tracks of one object merged": {f"{_PLACE}.objects:merge_tracks": _first},
    "anchors along the best path": {f"{_PLACE}.objects:consistent_chains": _first},
    "strands cut where joined wrongly": {f"{_PLACE}.frame_evidence:cut_misjoined": _first},
    "strands cut where they leave the object": {f"{_PLACE}.strand_cutting:_leaving": _none},
    "the frame's own chains as hypotheses": {f"{_PLACE}.follow:own_shapes": _none},
    "what the camera contradicts": {f"{_PLACE}.frame_evidence:_contradicted_share": _zero},
    "hypotheses of all frames decided together": {f"{_PLACE}.follow:most_likely_path": _cheapest},
    "places smoothed over time": {f"{_PLACE}.shape_smoothing:whittaker_smooth": _first},
    "depth smoothed over time": {f"{_PLACE}.shape_smoothing:smooth_joint_depth": _first},
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
    level: str = "hard",
    captures: list[Path] | None = None,
) -> Iterator[str]:
    """Measure tracking without each of its steps, and yield the lines of a table.

    own : names of motions that need no file, separated by commas; may be empty. seeds, start : number of sequences of each
    motion, and first seed. frames : number per sequence, 30 per second. motions : file of motion capture; repeat for more.
    sensor, width : simulated camera, and width of its images in px, which are 480 px high. level : of difficulty.
    captures : folder of captures with truth.npz; repeat for more.
    """
    names: list[str | Path] = [*([] if own == "none" else own.split(",")), *(motions or [])]
    chosen: list[tuple[TrueSequence | RecordedSequence, str]] = [
        (make_sequence(motion, seed, (width, 480), frames, level), sensor)
        for motion in names
        for seed in range(start, start + seeds)
    ]
    chosen += [(capture, "") for capture in recorded_sequences(captures or [], frames)]
    return table(chosen, list(STEPS))


if __name__ == "__main__":
    print_lines(main)

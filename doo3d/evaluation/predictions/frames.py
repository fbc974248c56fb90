"""Score predictions in frames with true cables: chains in metres, in the camera's optical frame."""

import re
from dataclasses import replace
from functools import partial
from pathlib import Path

from ...types import Detection, Frame
from ..benchmark.cases import Case, KnownFrame, folder_cases
from ..benchmark.evaluate import frame_badness
from ..benchmark.pictures import frame_caption, frame_panels
from ..benchmark.run import Benchmark
from ..metrics import correct, point_sets, run_length
from ..metrics.observed import Observed
from ..metrics.record import TIME, Record, amount, failures
from ..metrics.score import score
from .files import Prediction, outcome, read_prediction

COLUMNS = (
    correct.FRAMES,
    *correct.IN_IMAGE.columns,
    *point_sets.METRIC.columns,
    run_length.RUN_LENGTH,
    TIME,
    amount(("", "missing"), 7, "errors", failures),
)
"""Columns: frames correct by the strict rule, in space and in the image; the metrics of `point_sets`; expected run length in %;
median time of a frame; frames without a prediction."""


def frame_cases(folder: Path) -> list[Case]:
    """Return a case for each frame with known truth below a folder, named by the path of its capture and its own name.

    Captures whose names differ only by a number at the end are one family.
    """
    cases = folder_cases(folder)
    return [replace(case, name=f"{case.family}/{case.name}", family=re.sub(r"_\d+$", "", case.family)) for case in cases]


def prediction_benchmark(files: dict[tuple[str, str], list[Path]]) -> Benchmark:
    """Return the benchmark of predictions in frames with known truth; `files` are those of `prediction_files`."""
    return Benchmark(partial(measure_prediction, files=files), COLUMNS, frame_panels, frame_caption, frame_badness)


def measure_prediction(case: Case, files: dict[tuple[str, str], list[Path]]) -> list[Record]:
    """Read the prediction of a frame, and return its record; a missing one is scored as empty and counts as an error."""
    known: KnownFrame = case.load()
    paths = files[case.family, case.name]
    prediction = read_prediction(paths, 3) if paths else Prediction(Detection(()), None, float("nan"))
    detection = prediction.detection or Detection(())
    camera = known.data.camera if isinstance(known.data, Frame) else None
    values = score(detection.chains, known.truths, detection.crossings, camera)
    values = Record(values | point_set_values(detection, known) | {"ms": prediction.ms})
    return [case.record(values | outcome(paths) | {"correct": values.correct and bool(paths)}, detection)]


def point_set_values(detection: Detection, known: KnownFrame) -> Record:
    """Return the values of the metrics that only predictions are scored by; see `point_sets` and `run_length`."""
    observed = Observed(detection.chains, known.truths)
    return Record(point_sets.measure(observed) | run_length.measure(observed))

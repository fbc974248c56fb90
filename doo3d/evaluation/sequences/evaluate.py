"""Evaluate sequences with known truth: each frame alone, with earlier frames only, and with all frames."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from types import MappingProxyType
from typing import Any

import numpy as np

from ...config import Config
from ...errors import DooError
from ...pipeline import detect_with_stages
from ...track.background import BackgroundView
from ...track.detect_sequence import follow_objects
from ...track.first_pass import check_mode, first_pass_config
from ...track.image_strands import strands_in_image
from ...track.objects import find_objects
from ...track.observations import Observation, observe
from ...track.world_frame import in_world
from ...types import Array, Bools, Camera, Chain, Detection
from ..benchmark.cases import Case
from ..benchmark.pictures import panels, truth_chain
from ..benchmark.run import Benchmark
from ..metrics.correct import FRAMES, IN_IMAGE
from ..metrics.record import Column, Record, Records, amount, decimals, number
from ..metrics.score import score
from ..rendering.renderer import Rendered
from ..scenes.model import Truth
from .motions import FRAME_RATE
from .nodes import ORACLES, find_jumps, measured_nodes, node_offsets, oracle_detections
from .recorded import RecordedSequence
from .scenes import Sequence as TrueSequence

VARIANTS = {
    "single": "each frame for itself",
    "forward": "with earlier frames only, as a tracker",
    "sequence": "with earlier and later frames",
    "oracle-past": "the truth where it was measured, in this frame and earlier ones",
    "oracle-both": "the truth where it was measured, in this frame, earlier and later ones",
}
"""Variants that are compared in a sequence: name -> the frames or truth that each one uses."""


def _ratio(name: str, title: tuple[str, str], width: int, of: str, to: str, digits: int, factor: float = 1.0) -> Column:
    """Return a column with the sum of one value divided by the sum of another."""

    def summarize(rows: Records) -> dict[str, Any]:
        total = sum(row[to] for row in rows)
        return {name: factor * sum(row[of] for row in rows) / total if total else float("nan")}

    return Column(title, width, summarize, lambda values: decimals(values[name], digits))


HIDDEN = number(("hidden", "mean"), 7, "nodes_hidden", 1, np.mean, name="hidden_mean")
JUMPS = _ratio("jumps", ("jumps", "per 1000"), 9, "jumps", "nodes_compared", 1, 1e3)
COLUMNS = (
    FRAMES,
    *IN_IMAGE.columns,
    amount(("", "missing"), 8, "frames_missing", lambda rows: sum(row.chains == 0 for row in rows)),
    number(("nodes", "mm"), 7, "nodes_seen nodes_hidden", 1, np.mean, name="node_error"),
    number(("hidden", "median"), 7, "nodes_hidden", 1, name="hidden_median"),
    HIDDEN,
    number(("seen", "median"), 7, "nodes_seen", 1, name="seen_median"),
    number(("RMS", "hidden"), 7, "rms_hidden", 1),
    JUMPS,
    number(("time", "ms"), 7, "ms", 0, np.mean),
    _ratio("time_ratio", ("of", "single"), 7, "ms", "ms_single", 2),
)
"""Columns of the table: frames correct by the strict rule, and right in the image; frames without a chain, which have no nodes;
mean distance of the chains' nodes from their material points in mm, of all nodes, of those that the sensor did not measure, and
of the others; RMS distance of hidden parts from the true axis, median over frames; jumps per 1,000 nodes (moves of more than 5
radii against the material since the frame before); processor time per frame, and as a multiple of that of single frames."""


def sequence_benchmark(config: Config, give_count: bool = True) -> Benchmark:
    """Return the benchmark of sequences; the parameters are those of `measure_sequence`."""
    measure = partial(measure_sequence, config=config, give_count=give_count)
    return Benchmark(measure, COLUMNS, _panels, _caption, lambda row: (not row.correct, row.hidden_share))


def sequence_case(sequence: TrueSequence | RecordedSequence, sensor: str = "d435") -> Case:
    """Return the case of a sequence, whose frames are rendered with a simulated sensor."""
    records = len(VARIANTS) * len(sequence)
    return Case(sequence.name, sequence.name, partial(_itself, sequence), (), sequence.seed, sensor, records)


def _itself(sequence: TrueSequence | RecordedSequence) -> TrueSequence | RecordedSequence:
    return sequence


@dataclass(frozen=True)
class FirstPass:
    """The results of detecting one frame alone, without its images.

    Attributes
    ----------
    observation
        the detection, and the strands that were seen.
    truth
        the cable.
    measured
        (K,) bool, which nodes of the cable the sensor measured.
    score
        the score of the detection.
    camera
        the intrinsics.
    seconds
        processor time of the detection and of finding its strands, s.
    """

    observation: Observation
    truth: Truth
    measured: Bools
    score: Record
    camera: Camera
    seconds: tuple[float, float]


def measure_sequence(case: Case, config: Config, give_count: bool = True) -> list[Record]:
    """Render a sequence, detect its cable in three variants, and score these and two oracles (see VARIANTS).

    Images are rendered and discarded one after the other.

    Parameters
    ----------
    case
        the cable in motion, from `sequence_case`.
    config
        the settings; for 3-D.
    give_count
        whether the detection is given the number of objects, 1.

    Returns
    -------
    A record for each variant and frame.

    Raises
    ------
    InputError : the config is for images (mode "2d").
    """
    check_mode(config)
    if give_count:
        config = config.model_copy(update={"merge": config.merge.model_copy(update={"chains": 1})})
    frames = [first_pass(rendered, config) for rendered in case.load().frames(case.sensor)]
    observations = [frame.observation for frame in frames]
    detections = {"single": [frame.observation.detection for frame in frames]}
    seconds = {"single": sum(frame.seconds[0] for frame in frames)}
    for variant, past_only in (("forward", True), ("sequence", False)):
        start = time.process_time()
        objects = find_objects(in_world(observations), config)
        detections[variant] = list(follow_objects(observations, objects, config, past_only))
        seconds[variant] = time.process_time() - start + sum(sum(frame.seconds) for frame in frames)
    detections["forward"] = [_or_single(*both) for both in zip(detections["forward"], detections["single"], strict=True)]
    for variant, past_only in ORACLES.items():
        truths, measured = [frame.truth for frame in frames], [frame.measured for frame in frames]
        detections[variant], seconds[variant] = oracle_detections(truths, measured, past_only), float("nan")
    found = max((item.length for item in objects), default=float("nan"))
    times = {variant: 1e3 * value / len(frames) for variant, value in seconds.items()}
    rows = []
    for variant in VARIANTS:
        more = {"found_length": found, "ms": times[variant], "ms_single": times["single"]}
        for row, detection in zip(variant_rows(variant, frames, detections[variant], more), detections[variant], strict=True):
            rows.append(case.record(row, detection))
    return rows


def first_pass(rendered: Rendered, config: Config) -> FirstPass:
    """Run the detection in one frame alone; if it fails, keep only the strands in the color image."""
    frame, (truth,) = rendered.frame, rendered.truths
    config = first_pass_config(config)
    start = time.process_time()
    try:
        detection, stages = detect_with_stages(frame, config, rendered.mask)
        detected = time.process_time()
        background = BackgroundView.of(frame, stages.scene.mask)
        observation = replace(observe(detection, stages, config), background=background)
    except DooError as error:
        detected = time.process_time()
        nothing = Detection((), frame=frame.name, timestamp=frame.timestamp, notes=(str(error),))
        strands, background = strands_in_image(frame, config, rendered.mask), BackgroundView.of(frame, rendered.mask)
        observation = Observation(nothing, strands, None, background, is_given=True, object_given=True)
    seconds = detected - start, time.process_time() - detected
    chains = observation.detection.chains
    measured = measured_nodes(truth, frame.depth)
    return FirstPass(observation, truth, measured, score(chains, (truth,), camera=frame.camera), frame.camera, seconds)


def _or_single(detection: Detection, single: Detection) -> Detection:
    """Return the detection of a tracker; the single-frame detection as long as the tracker has no object."""
    return detection if detection.chains else replace(single, chains=tuple(replace(chain, id=None) for chain in single.chains))


def variant_rows(
    variant: str, frames: Sequence[FirstPass], detections: Sequence[Detection], more: Mapping[str, Any] = MappingProxyType({})
) -> list[Record]:
    """Return the record of each frame in one variant, with the values of `more`.

    The longest chain of a frame is compared node by node: `nodes_seen` and `nodes_hidden` are the distances in mm of its nodes
    from their material points, where the sensor measured these and where it did not.
    """
    truths = [frame.truth for frame in frames]
    offsets = node_offsets([_longest(each) for each in detections], truths, keeps_direction=variant not in ("single", "forward"))
    jumps, counted = find_jumps(offsets, truths[0].radius)
    distances = 1e3 * np.linalg.norm(offsets, axis=2)
    rows = []
    for k, (frame, detection) in enumerate(zip(frames, detections, strict=True)):
        values = frame.score if variant == "single" else score(detection.chains, (frame.truth,), camera=frame.camera)
        known = np.isfinite(distances[k])
        seen, hidden = distances[k][known & frame.measured], distances[k][known & ~frame.measured]
        nodes = {
            "hidden_share": float((~frame.measured).mean()),
            "node_error": _mean(distances[k][known]),
            "node_error_hidden": _mean(hidden),
            "node_error_seen": _mean(seen),
            "jumps": int(jumps[k].sum()),
            "nodes_compared": int(counted[k]) * distances.shape[1],
            "confidence": detection.confidence or 0.0,
            "true_length": frame.truth.length,
            "nodes_seen": seen.tolist(),
            "nodes_hidden": hidden.tolist(),
        }
        scores = {key: values[key] for key in ("correct", "image_correct", "chains", "rms_hidden", "reasons")}
        rows.append(Record({"frame": f"{k:04d}", "time": k / FRAME_RATE, "variant": variant} | scores | nodes | dict(more)))
    return rows


def _mean(values: Array) -> float:
    return float(values.mean()) if len(values) else float("nan")


def _longest(detection: Detection) -> Chain | None:
    return max(detection.chains, key=lambda chain: chain.length, default=None)


def _panels(row: Record) -> tuple[Array, Array]:
    """Draw the detection of a record over its frame, and the true cable over the same frame."""
    rendered = row.case.load().frame(int(row.frame), row.case.sensor)
    return panels(rendered.frame, row.detection, Detection(tuple(map(truth_chain, rendered.truths))))


def _caption(row: Record) -> str:
    return (
        f"{row.family}   {row.time:.2f} s   {row.variant}: {'; '.join(row.reasons) or 'correct'}   (detection left, truth right)"
    )

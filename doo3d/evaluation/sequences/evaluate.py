"""Detect in sequences with known truth: each frame for itself, with earlier frames only, and with all frames."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...config import Config
from ...errors import DooError
from ...pipeline import detect_with_stages
from ...sequence.detect_sequence import check_mode, combine
from ...sequence.objects import find_objects
from ...sequence.observations import Observation, observe
from ...types import Bools, Chain, Detection
from ..metrics.score import FrameScore, score
from ..rendering.renderer import Rendered
from ..scenes.model import Truth
from .motions import FRAME_RATE
from .nodes import find_jumps, measured_nodes, node_offsets
from .rows import VARIANTS, Row, SequenceResult
from .scenes import Sequence as TrueSequence


@dataclass(frozen=True)
class FirstPass:
    """What is kept of one frame once it is detected for itself; its images are not.

    Attributes
    ----------
    name
        names of the sequence and of the frame.
    observation
        the detection, and the strands that were seen.
    truth
        the cable.
    measured
        (K,) bool, the nodes of the cable that the sensor measured.
    score
        the score of the detection.
    seconds
        processor time of the detection, and of finding the strands in it, s.
    """

    name: str
    observation: Observation
    truth: Truth
    measured: Bools
    score: FrameScore
    seconds: tuple[float, float]


def evaluate_sequence(
    sequence: TrueSequence,
    config: Config,
    give_count: bool = True,
    sensor: str = "d435",
    report: Callable[[FirstPass], None] = lambda frame: None,
) -> SequenceResult:
    """Render a sequence, detect in it in three variants (see VARIANTS), and compare the chains with the cable.

    Images are rendered, used and dropped one after the other.

    Parameters
    ----------
    sequence
        the cable in motion.
    config
        the settings; for 3-D.
    give_count
        whether to tell the detection that there is one object.
    sensor
        simulated depth camera, as for `render`.
    report
        called after the first pass of each frame.

    Raises
    ------
    InputError : the config is for images (mode "2d").
    """
    check_mode(config)
    if give_count:
        config = config.model_copy(
            update={
                "merge": config.merge.model_copy(update={"chains": 1}),
                "sequence": config.sequence.model_copy(update={"chains": 1}),
            }
        )
    frames = []
    for rendered in sequence.frames(sensor):
        frames.append(_first_pass(sequence.name, rendered, config))
        report(frames[-1])
    observations = [frame.observation for frame in frames]
    detections = {"single": [frame.observation.detection for frame in frames]}
    seconds = {"single": sum(frame.seconds[0] for frame in frames)}
    for variant, past_only in (("forward", True), ("sequence", False)):
        start = time.process_time()
        detections[variant] = list(combine(observations, config, past_only))
        seconds[variant] = time.process_time() - start + sum(sum(frame.seconds) for frame in frames)
    detections["forward"] = [_or_single(*both) for both in zip(detections["forward"], detections["single"], strict=True)]
    objects = find_objects(observations, config)
    return SequenceResult(
        sequence.name,
        tuple(row for variant in VARIANTS for row in _rows(sequence, variant, frames, detections[variant])),
        float(np.mean([frame.truth.length for frame in frames])),
        max((item.length for item in objects), default=float("nan")),
        seconds,
    )


def _first_pass(sequence: str, rendered: Rendered, config: Config) -> FirstPass:
    """Detect in a frame for itself. A frame that cannot be used shows nothing."""
    frame, (truth,) = rendered.frame, rendered.truths
    start = time.process_time()
    try:
        detection, stages = detect_with_stages(frame, config, rendered.mask)
        detected = time.process_time()
        observation = observe(detection, stages, config)
    except DooError as error:
        detected = time.process_time()
        nothing = Detection((), frame=frame.name, timestamp=frame.timestamp, notes=(str(error),))
        observation = Observation(nothing, ())
    seconds = detected - start, time.process_time() - detected
    chains = observation.detection.chains
    measured = measured_nodes(truth, frame.depth)
    return FirstPass(f"{sequence}/{frame.name}", observation, truth, measured, score(chains, (truth,)), seconds)


def _or_single(detection: Detection, single: Detection) -> Detection:
    """Return the detection of a tracker; that of the frame alone as long as there is nothing to track."""
    return detection if detection.chains else replace(single, chains=tuple(replace(chain, id=None) for chain in single.chains))


def _rows(sequence: TrueSequence, variant: str, frames: Sequence[FirstPass], detections: Sequence[Detection]) -> list[Row]:
    """Return the row of each frame in one variant; the longest chain of a frame is compared node by node."""
    truths = [frame.truth for frame in frames]
    chains = [_longest(detection) for detection in detections]
    offsets = node_offsets(chains, truths, keeps_direction=variant == "sequence")
    jumps, counted = find_jumps(offsets, sequence.motion.radius)
    distances = np.linalg.norm(offsets, axis=2)
    return [
        Row(
            sequence=sequence.name,
            frame=k,
            time=k / FRAME_RATE,
            variant=variant,
            score=frame.score if variant == "single" else score(detections[k].chains, (frame.truth,)),
            detection=detections[k],
            distances=distances[k],
            measured=frame.measured,
            jumps=int(jumps[k].sum()),
            nodes_compared=int(counted[k]) * distances.shape[1],
        )
        for k, frame in enumerate(frames)
    ]


def _longest(detection: Detection) -> Chain | None:
    return max(detection.chains, key=lambda chain: chain.length, default=None)

"""The two jobs of one frame: detect its chains, then render its files. In between, the run tracks chains over the frames.

Workers may be other processes: arguments and results of the jobs are small and can be pickled. The frame's own data is
neither; it stays in the FrameCache of the process that read it.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace

from ..config import Config
from ..errors import describe_error, error_code
from ..inputs import FrameRef
from ..pipeline import detect
from ..types import Detection
from .capture_checks import chain_evidence, frame_evidence
from .frame_cache import FrameCache
from .frame_files import encode_frame, encode_result
from .frame_record import OK, FrameRecord
from .methods import Method, detect_alone


@dataclass(frozen=True)
class DetectedFrame:
    """The outcome of detection in one frame, before the frame's files are made.

    Attributes
    ----------
    record
        status, times, notes and error of the frame; lengths, radii and the fraction occluded are still empty.
    detection
        the chains found; None if the frame failed.
    cache_key
        key of the frame's data in the FrameCache of the process that did the detection; empty if the frame failed.
    files
        suffix -> content of files of the frame besides its JSON result and its picture.
    has_picture
        whether a picture is drawn.
    """

    record: FrameRecord
    detection: Detection | None = None
    cache_key: str = ""
    files: dict[str, bytes] = field(default_factory=dict)
    has_picture: bool = True


def detect_frame(
    cache: FrameCache, frame: FrameRef, config: Config, method: Method = detect_alone, thorough: bool = False
) -> DetectedFrame:
    """Read one frame, detect its chains, and keep its data in the cache for rendering.

    Parameters
    ----------
    cache
        FrameCache of the process that does this job.
    frame
        the frame to read.
    config
        configuration of the detection.
    method
        how the chains are found.
    thorough
        whether to look also for color that is not registered to the depth, and for red and blue exchanged.

    Returns
    -------
    The detection and the frame's record. No exception is raised: on any error, `detection` is None and the record has the status
    "failed" and the error's message.
    """
    start = time.perf_counter()
    record = FrameRecord.failed(frame)
    try:
        loaded = frame.load()
        read_seconds = time.perf_counter() - start
        found = method(loaded, frame, config)
        detection = replace(found.detection, frame=frame.name, timestamp=frame.timestamp)
        evidence = frame_evidence(loaded, detection, config, lambda data: detect(data, config)) if thorough else {}
    except Exception as error:
        seconds = time.perf_counter() - start
        return DetectedFrame(replace(record, error=describe_error(error), code=error_code(error), seconds=seconds))
    key = cache.add(loaded.data) if found.has_picture else ""
    stages = {"read": read_seconds, **detection.seconds}
    seconds = time.perf_counter() - start
    record = replace(record, status=OK, seconds=seconds, notes=detection.notes, stages=stages, evidence=evidence)
    return DetectedFrame(record, replace(detection, seconds={}), key, found.files, found.has_picture)


def render_frame(cache: FrameCache, frame: FrameRef, detected: DetectedFrame) -> tuple[FrameRecord, dict[str, bytes] | None]:
    """Return the complete record of a detected frame and the content of its files; nothing is written to disk.

    Parameters
    ----------
    cache
        FrameCache of the process that does this job. If it does not hold the frame's data, they are read from disk again.
    frame
        reference to the frame.
    detected
        the result of `detect_frame`, with a detection; its chains may have been given ids or been reversed by tracking.

    Returns
    -------
    record : the complete record; its status is "failed" if an error occurred. No exception is raised.
    files : file name suffix (".json", ".png") -> content; None if an error occurred.
    """
    assert detected.detection is not None
    start = time.perf_counter()
    try:
        evidence = detected.record.evidence
        if detected.has_picture:
            data = cache.take(detected.cache_key) or frame.load().data
            files = encode_frame(detected.detection, data)
            evidence = evidence | chain_evidence(detected.detection, data)
        else:
            files = encode_result(detected.detection)
        files |= detected.files
    except Exception as error:
        record = FrameRecord.failed(frame, describe_error(error), error_code(error))
        return replace(record, seconds=detected.record.seconds + time.perf_counter() - start), None
    chains = detected.detection.chains
    segments = sum(len(chain.occluded) for chain in chains)
    seconds = time.perf_counter() - start
    record = replace(
        detected.record,
        seconds=detected.record.seconds + seconds,
        stages=detected.record.stages | {"draw": seconds},
        lengths=tuple(chain.length for chain in chains),
        radii=tuple(chain.radius for chain in chains),
        confidences=tuple(chain.confidence for chain in chains),
        occluded=sum(int(chain.occluded.sum()) for chain in chains) / segments if segments else None,
        objects=len(detected.detection.objects) if detected.detection.objects else None,
        junctions=len(detected.detection.junctions) if detected.detection.objects else None,
        units="m" if detected.detection.mode == "3d" else "px",
        evidence=evidence,
    )
    return record, files

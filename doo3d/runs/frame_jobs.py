"""Define the two jobs of a frame: detect its chains, and render its files. In between, the run tracks the chains.

Since workers may be other processes, arguments and results of the jobs are small and picklable. The data of the frame is neither;
it stays in the FrameCache of the process that read it.
"""

import time
from dataclasses import dataclass, field, replace

from ..config import Config
from ..errors import describe_error, error_code
from ..inputs import FrameRef
from ..pipeline import detect
from ..types import Detection
from .capture_checks import chain_evidence, frame_evidence
from .frame_cache import FrameCache
from .frame_files import encode_frame
from .frame_record import OK, FrameRecord
from .methods import Method, detect_alone
from .pictures import ALL_PICTURES, Pictures


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
    """

    record: FrameRecord
    detection: Detection | None = None
    cache_key: str = ""
    files: dict[str, bytes] = field(default_factory=dict)


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
        the function that finds the chains.
    thorough
        whether to check also that the color is registered to the depth, and that red and blue are not exchanged.

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
        notes = (*loaded.notes, *found.detection.notes)
        detection = replace(found.detection, frame=frame.name, timestamp=frame.timestamp, notes=notes)
        evidence = frame_evidence(loaded, detection, config, lambda data: detect(data, config)) if thorough else {}
    except Exception as error:
        seconds = time.perf_counter() - start
        return DetectedFrame(replace(record, error=describe_error(error), code=error_code(error), seconds=seconds))
    key = cache.add(loaded.data)
    stages = {"read": read_seconds, **detection.seconds}
    seconds = time.perf_counter() - start
    record = replace(record, status=OK, seconds=seconds, notes=detection.notes, stages=stages, evidence=evidence)
    return DetectedFrame(record, replace(detection, seconds={}), key, found.files)


def render_frame(
    cache: FrameCache, frame: FrameRef, detected: DetectedFrame, pictures: Pictures = ALL_PICTURES
) -> tuple[FrameRecord, dict[str, bytes] | None]:
    """Return the complete record of a detected frame and the content of its files; nothing is written to disk.

    Parameters
    ----------
    cache
        FrameCache of the process that does this job. If it does not hold the frame's data, they are read from disk again.
    frame
        reference to the frame.
    detected
        the result of `detect_frame`, with a detection; its chains may have been given ids or been reversed by tracking.
    pictures
        whether a picture is drawn, from `Pictures.at`.

    Returns
    -------
    record : the complete record; its status is "failed" if an error occurred. No exception is raised.
    files : file name suffix (".json", ".jpg") -> content; None if an error occurred.
    """
    assert detected.detection is not None
    start = time.perf_counter()
    record = _with_chains(detected.record, detected.detection)
    picture = pictures.kind if pictures.wants(record) else None
    kinds = ("json", *([picture] if picture else []), *(["instances"] if pictures.instances else []))
    try:
        data = cache.take(detected.cache_key) or frame.load().data
        files = encode_frame(detected.detection, data, kinds) | detected.files
        evidence = record.evidence | chain_evidence(detected.detection, data)
    except Exception as error:
        record = FrameRecord.failed(frame, describe_error(error), error_code(error))
        return replace(record, seconds=detected.record.seconds + time.perf_counter() - start), None
    seconds = time.perf_counter() - start
    stages, seconds = record.stages | {"draw": seconds}, record.seconds + seconds
    record = replace(record, seconds=seconds, stages=stages, evidence=evidence, picture=picture, instances=pictures.instances)
    return record, files


def draw_frame(cache: FrameCache, frame: FrameRef, detection: Detection, picture: str) -> tuple[dict[str, bytes], str | None]:
    """Draw the picture of a frame that an earlier run finished without one.

    Parameters
    ----------
    cache
        FrameCache of the process that does this job; not used.
    frame
        reference to the frame, which is read from disk.
    detection
        the chains in the results of the frame.
    picture
        kind of the picture, such as "jpg".

    Returns
    -------
    files : file name suffix -> content; empty if an error occurred. No exception is raised.
    error : the error's message; None if there was none.
    """
    try:
        return encode_frame(detection, frame.load().data, [picture]), None
    except Exception as error:
        return {}, describe_error(error)


def _with_chains(record: FrameRecord, detection: Detection) -> FrameRecord:
    """Return the record of a frame, completed with the lengths, radii and confidences of its chains."""
    chains = detection.chains
    segments = sum(len(chain.occluded) for chain in chains)
    return replace(
        record,
        lengths=tuple(chain.length for chain in chains),
        radii=tuple(chain.radius for chain in chains),
        confidences=tuple(chain.confidence for chain in chains),
        doubtful=tuple((chain.length, chain.confidence) for chain in detection.doubtful),
        occluded=sum(int(chain.occluded.sum()) for chain in chains) / segments if segments else None,
        objects=len(detection.objects) if detection.objects else None,
        junctions=len(detection.junctions) if detection.objects else None,
        units="m" if detection.mode == "3d" else "px",
    )

"""The two jobs of one frame: detect its chains, then render its files. In between, the run tracks chains over the frames.

Workers may be other processes: arguments and results of the jobs are small and can be pickled. The frame's own data is
neither; it stays in the FrameCache of the process that read it.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

from ..config import Config
from ..errors import describe_error, error_code
from ..inputs import FrameRef
from ..pipeline import detect
from ..types import Detection
from .frame_cache import FrameCache
from .frame_files import encode_frame
from .frame_record import OK, FrameRecord


@dataclass(frozen=True)
class DetectedFrame:
    """The result of `detect_frame`.

    Attributes
    ----------
    record
        of the frame so far.
    detection
        the chains; None if the frame failed.
    cache_key
        key of the frame's data in the FrameCache of the process that detected.
    """

    record: FrameRecord
    detection: Detection | None = None
    cache_key: str = ""


def detect_frame(cache: FrameCache, frame: FrameRef, config: Config) -> DetectedFrame:
    """Read one frame, detect its chains, and keep its data in the cache; errors of any kind end up in the record.

    Parameters
    ----------
    cache
        of this process.
    frame
        the frame to read.
    config
        configuration of the detection.
    """
    start = time.perf_counter()
    record = FrameRecord.failed(frame)
    try:
        loaded = frame.load()
        read_seconds = time.perf_counter() - start
        detection = replace(detect(loaded.data, config, loaded.mask_for(config)), frame=frame.name, timestamp=frame.timestamp)
    except Exception as error:
        seconds = time.perf_counter() - start
        return DetectedFrame(replace(record, error=describe_error(error), code=error_code(error), seconds=seconds))
    key = cache.add(loaded.data)
    stages = {"read": read_seconds, **detection.seconds}
    record = replace(record, status=OK, seconds=time.perf_counter() - start, notes=detection.notes, stages=stages)
    return DetectedFrame(record, replace(detection, seconds={}), key)


def render_frame(cache: FrameCache, frame: FrameRef, detected: DetectedFrame) -> tuple[FrameRecord, dict[str, bytes] | None]:
    """Encode the files of a detected frame.

    Parameters
    ----------
    cache
        of this process; data that it does not hold is read from disk again.
    frame
        the frame.
    detected
        the result of `detect_frame`; its detection may have been changed since, by tracking.

    Returns
    -------
    The frame's complete record, and its files as suffix -> content; None for the files if they cannot be made.
    """
    assert detected.detection is not None
    start = time.perf_counter()
    try:
        data = cache.take(detected.cache_key) or frame.load().data
        files = encode_frame(detected.detection, data)
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
        occluded=sum(int(chain.occluded.sum()) for chain in chains) / segments if segments else None,
        units="m" if detected.detection.mode == "3d" else "px",
    )
    return record, files

"""The work on one frame, in two halves: find its chains, then draw them. Between the two the run sees all frames in order.

Both may be done by another process, so what goes in and out can be pickled and is small; the frame's own data is not, and
stays where it was read.
"""

from __future__ import annotations

import secrets
import time
import traceback
from collections import OrderedDict
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from ..config import Config
from ..errors import DooError
from ..inputs import FrameRef
from ..pipeline import detect
from ..types import Cloud, Detection, Frame, Image
from .frame_files import encode_frame

OK, FAILED = "ok", "failed"
UNEXPECTED = "unexpected"
_KEPT = 8  # frames that wait in one process for their picture; what has waited longer is read again
_waiting: OrderedDict[str, Frame | Cloud | Image] = OrderedDict()


@dataclass(frozen=True)
class FrameRecord:
    """What became of one frame.

    lengths, radii : of the chains, longest first, m (px in 2-D). occluded : share of all segments, 0 to 1; None without
    chains. units : "m" or "px". seconds : for reading, detecting and drawing; stages : for each of these, and each stage.
    error : the reason where status is failed, a sentence. code : of that error, see DooError; "unexpected" of one that nobody
    foresaw; None in the journals of versions that did not write it.
    """

    name: str
    source: str
    timestamp: float | None
    status: str
    seconds: float = 0.0
    lengths: tuple[float, ...] = ()
    radii: tuple[float, ...] = ()
    occluded: float | None = None
    units: str = "m"
    notes: tuple[str, ...] = ()
    error: str | None = None
    code: str | None = None
    stages: dict[str, float] = field(default_factory=dict)

    @staticmethod
    def of(entry: FrameRef, error: str | None = None, code: str | None = None) -> FrameRecord:
        """Of a frame of which nothing has come."""
        return FrameRecord(entry.name, str(entry.source), entry.timestamp, FAILED, error=error, code=code)

    def to_dict(self) -> dict[str, Any]:
        """What the manifest holds of a frame: nothing that differs from run to run."""
        return {
            "name": self.name,
            "status": self.status,
            "source": self.source,
            "timestamp": self.timestamp,
            "chains": len(self.lengths),
            "lengths": list(self.lengths),
            "radii": list(self.radii),
            "occluded": self.occluded,
            "units": self.units,
            "error": self.error,
            "code": self.code,
        }

    def to_journal(self) -> dict[str, Any]:
        """All of it, for `from_journal`."""
        return asdict(self)

    @staticmethod
    def from_journal(values: dict[str, Any]) -> FrameRecord:
        """The record that `to_journal` gave; JSON knows neither tuples nor NaN.

        Raises
        ------
        TypeError, KeyError : it did not give this.
        """
        numbers = {
            key: tuple(float("nan") if value is None else float(value) for value in values[key]) for key in ("lengths", "radii")
        }
        return FrameRecord(**values | numbers | {"notes": tuple(values["notes"])})


@dataclass(frozen=True)
class Found:
    """The first half of a frame: its record, what was found (None where that failed), and where its data waits."""

    record: FrameRecord
    detection: Detection | None = None
    cache_key: str = ""


def detect_frame(entry: FrameRef, config: Config) -> Found:
    """Read one frame and detect in it.

    What goes wrong, expected or not, is in the record: it is this frame's matter only.
    """
    start = time.perf_counter()
    record = FrameRecord.of(entry)
    try:
        shot = entry.load()
        read = time.perf_counter() - start
        detection = replace(detect(shot.data, config, shot.mask_for(config)), frame=entry.name, timestamp=entry.timestamp)
    except Exception as error:
        return Found(replace(record, error=reason(error), code=code_of(error), seconds=time.perf_counter() - start))
    cache_key = secrets.token_hex(8)
    _waiting[cache_key] = shot.data
    while len(_waiting) > _KEPT:
        _waiting.popitem(last=False)
    stages = {"read": read, **detection.seconds}
    record = replace(record, status=OK, seconds=time.perf_counter() - start, notes=detection.notes, stages=stages)
    return Found(record, replace(detection, seconds={}), cache_key)


def render_frame(entry: FrameRef, found: Found) -> tuple[FrameRecord, dict[str, bytes] | None]:
    """The frame's files, suffix to content, and its record; None for the files where they cannot be made.

    The detection in `found` may have been changed since `find`. Where the data no longer waits it is read again.
    """
    assert found.detection is not None
    start = time.perf_counter()
    try:
        data = _waiting.pop(found.cache_key, None) or entry.load().data
        files = encode_frame(found.detection, data)
    except Exception as error:
        failed = FrameRecord.of(entry, reason(error), code_of(error))
        return replace(failed, seconds=found.record.seconds + time.perf_counter() - start), None
    chains = found.detection.chains
    segments = sum(len(chain.occluded) for chain in chains)
    taken = time.perf_counter() - start
    record = replace(
        found.record,
        seconds=found.record.seconds + taken,
        stages=found.record.stages | {"draw": taken},
        lengths=tuple(chain.length for chain in chains),
        radii=tuple(chain.radius for chain in chains),
        occluded=sum(int(chain.occluded.sum()) for chain in chains) / segments if segments else None,
        units="m" if found.detection.mode == "3d" else "px",
    )
    return record, files


def reason(error: Exception) -> str:
    """Why a frame failed, a sentence."""
    return str(error) if isinstance(error, DooError) else unexpected(error)


def code_of(error: Exception) -> str:
    """The code of the error, "unexpected" where nobody foresaw it."""
    return error.code if isinstance(error, DooError) else UNEXPECTED


def unexpected(error: Exception) -> str:
    """Type, message and place of an error that nobody foresaw."""
    calls = traceback.extract_tb(error.__traceback__)
    own = [call for call in calls if "doo3d" in Path(call.filename).parts] or calls
    at = f"{Path(own[-1].filename).name}:{own[-1].lineno}" if own else "?"
    return f"{type(error).__name__} at {at}: {error} (this is a fault in doo3d, please report it)"

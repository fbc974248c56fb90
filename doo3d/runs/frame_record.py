"""The record of one frame of a run: for the journal, the manifest and the progress line."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any

from ..inputs import FrameRef

OK, FAILED = "ok", "failed"


@dataclass(frozen=True)
class FrameRecord:
    """The outcome of one frame.

    Attributes
    ----------
    name, source, timestamp
        of the frame, as in its FrameRef.
    status
        OK or FAILED.
    seconds
        time for reading, detecting and rendering; `stages` has each of these, and each stage of the method.
    lengths, radii
        of the chains, longest first, m (px in 2-D).
    occluded
        fraction of all segments that are occluded, 0 to 1; None without chains.
    units
        "m" or "px".
    notes
        of the detection, a sentence each.
    error
        reason of the failure, a sentence; None if the status is OK.
    code
        of that error, see DooError; "unexpected" if no DooError was raised, None in journals of early versions.
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
    def failed(frame: FrameRef, error: str | None = None, code: str | None = None) -> FrameRecord:
        """Return the record of a frame without a result."""
        return FrameRecord(frame.name, str(frame.source), frame.timestamp, FAILED, error=error, code=code)

    def to_dict(self) -> dict[str, Any]:
        """Return the frame's entry in the manifest, without times, which differ from run to run."""
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
        """Return all fields, as `from_journal` reads them."""
        return asdict(self)

    @staticmethod
    def from_journal(values: dict[str, Any]) -> FrameRecord:
        """Return the record that `to_journal` wrote; JSON has neither tuples nor NaN.

        Raises
        ------
        TypeError, KeyError : the values are not those of `to_journal`.
        """
        numbers = {
            key: tuple(float("nan") if value is None else float(value) for value in values[key]) for key in ("lengths", "radii")
        }
        return FrameRecord(**values | numbers | {"notes": tuple(values["notes"])})

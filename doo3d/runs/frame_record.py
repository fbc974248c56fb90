"""Define the record of one frame of a run, for the journal, the manifest and the progress line."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any

from ..inputs import FrameRef

OK, FAILED = "ok", "failed"


@dataclass(frozen=True)
class FrameRecord:
    """The outcome of one frame, as in the run's journal, its manifest and the line printed per frame.

    Attributes
    ----------
    name
        the frame's name, and that of its files.
    source
        path of the file or folder that the frame was read from.
    timestamp
        time of the frame, s; None if the capture has no times.
    status
        "ok" or "failed".
    seconds
        time that reading, detecting and rendering took, s.
    lengths, radii
        length and radius of each chain, longest chain first, m (px in 2-D); a radius is NaN if unknown.
    confidences
        confidence of each chain, 0 to 1.
    doubtful
        length, m (px in 2-D), and confidence of each doubtful chain, longest first; the other fields do not count these.
    occluded
        fraction of the segments of all chains that are occluded, 0 to 1; None without chains.
    objects, junctions
        number of objects and of junctions; None if the detection did not look for branched objects.
    units
        unit of the lengths and radii: "m", or "px" in 2-D.
    notes
        remarks of the detection, a sentence each.
    error
        the reason why the frame failed; None if the status is "ok".
    code
        stable code of the error, such as "mask-shape"; "unexpected" for a fault in doo3d. None if the status is "ok".
    picture
        kind of its picture, "jpg" or "png"; None if none was drawn.
    instances
        whether the image of its instance labels was written.
    stages
        name of a step -> time that it took, s. The steps are "read", each stage of the detection, and "draw".
    evidence
        evidence of this frame for the checks over all frames; see `capture_checks`.
    """

    name: str
    source: str
    timestamp: float | None
    status: str
    seconds: float = 0.0
    lengths: tuple[float, ...] = ()
    radii: tuple[float, ...] = ()
    confidences: tuple[float, ...] = ()
    doubtful: tuple[tuple[float, float], ...] = ()
    occluded: float | None = None
    objects: int | None = None
    junctions: int | None = None
    units: str = "m"
    notes: tuple[str, ...] = ()
    error: str | None = None
    code: str | None = None
    picture: str | None = None
    instances: bool = False
    stages: dict[str, float] = field(default_factory=dict)
    evidence: dict[str, Any] = field(default_factory=dict)

    @staticmethod
    def failed(frame: FrameRef, error: str | None = None, code: str | None = None) -> FrameRecord:
        """Return the record of a frame that failed, with the error's message and code if they are given."""
        return FrameRecord(frame.name, str(frame.source), frame.timestamp, FAILED, error=error, code=code)

    def to_dict(self) -> dict[str, Any]:
        """Return the frame's entry in `manifest.json`, as plain values.

        The entry has the numbers of chains and of doubtful ones, but neither the notes nor the times that the steps took, so that
        equal runs write equal manifests.
        """
        trees = {} if self.objects is None else {"objects": self.objects, "junctions": self.junctions}
        return {
            "name": self.name,
            "status": self.status,
            "source": self.source,
            "timestamp": self.timestamp,
            "chains": len(self.lengths),
            **trees,
            "lengths": list(self.lengths),
            "radii": list(self.radii),
            "confidences": list(self.confidences),
            "doubtful": len(self.doubtful),
            "occluded": self.occluded,
            "units": self.units,
            "picture": self.picture,
            **({"instances": True} if self.instances else {}),
            "error": self.error,
            "code": self.code,
        }

    def to_journal(self) -> dict[str, Any]:
        """Return all fields as name -> value, for this frame's line in `progress.jsonl`; `from_journal` reads it back."""
        return dict(vars(self))

    @staticmethod
    def from_journal(values: dict[str, Any]) -> FrameRecord:
        """Return the record held by a parsed line of `progress.jsonl`, the inverse of `to_journal`.

        Lists become tuples again, and null among the numbers of the chains becomes NaN, since JSON has neither. Other entries of
        the line, such as the checks of the frame's files, are left out.

        Raises
        ------
        TypeError, KeyError : a field is missing or of another type.
        """
        known = {field.name: values[field.name] for field in fields(FrameRecord) if field.name in values}
        numbers = {
            key: tuple(float("nan") if value is None else float(value) for value in values[key])
            for key in ("lengths", "radii", "confidences")
        }
        doubtful = tuple((float(length), float(confidence)) for length, confidence in values["doubtful"])
        return FrameRecord(**known | numbers | {"notes": tuple(values["notes"]), "doubtful": doubtful})

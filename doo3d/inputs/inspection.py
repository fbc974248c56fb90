"""What a capture is, from its entries and a look at a few of its frames."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ..errors import InputError
from ..types import Camera, Cloud, Floats, Frame
from .capture import Capture, FrameData, FrameRef

SCHEMA = "doo3d/info/1"
PERCENTILES = (1, 50, 99)  # of the depth: single readings are off by any amount
MEASURED = (0.05, 30.0)  # m: where depth cameras measure; a median elsewhere is of another unit
WIDEST, NARROWEST = 0.25, 8.0  # widths of the image: focal lengths between a fish eye's and a telescope's
CLOUD = (0.01, 100.0)  # m across: clouds with a cable in them
_GAP = 3.0  # medians: a longer time between two frames is worth a word


@dataclass(frozen=True)
class Look:
    """What one frame holds.

    index, name, timestamp : of the entry. error : why it cannot be read, a sentence; the rest is then as it is by default.
    kind : "depth", "cloud" or "image". size : (width, height) px. depth : m, at PERCENTILES; None where none is measured.
    missing : share of the pixels without depth. points, low, high : of a cloud, their number and the corners of its box, m.
    """

    index: int
    name: str
    timestamp: float | None
    error: str | None = None
    kind: str | None = None
    size: tuple[int, int] | None = None
    camera: Camera | None = None
    color: bool = False
    mask: bool = False
    pose: bool = False
    viewpoint: bool = False
    depth: tuple[float, float, float] | None = None
    missing: float | None = None
    points: int | None = None
    low: tuple[float, float, float] | None = None
    high: tuple[float, float, float] | None = None


@dataclass(frozen=True)
class Timing:
    """When the frames were taken: s of the first and of the last, frames per second by the median step, the longest step."""

    first: float
    last: float
    rate: float | None
    longest: float | None
    longest_after: str | None


@dataclass(frozen=True)
class Summary:
    """A capture.

    frames, names : how many there are, and what the first and the last are called. total, selection : how many the whole
    capture has, and which of them are meant, empty for all. parts : topics or streams, where the format names them.
    """

    path: str
    format: str
    frames: int
    total: int
    selection: str
    names: tuple[str, str] | None
    parts: tuple[str, ...]
    timing: Timing | None
    looks: tuple[Look, ...]

    @property
    def good(self) -> list[Look]:
        """The frames that could be read."""
        return [look for look in self.looks if look.error is None]

    @property
    def depth(self) -> tuple[float, float, float] | None:
        """m: the least, the median and the greatest of the frames' depths at PERCENTILES."""
        found = np.array([look.depth for look in self.good if look.depth is not None])
        return (float(found[:, 0].min()), float(np.median(found[:, 1])), float(found[:, 2].max())) if len(found) else None

    @property
    def missing(self) -> float | None:
        """Share of the pixels without depth, the mean of the frames."""
        found = [look.missing for look in self.good if look.missing is not None]
        return float(np.mean(found)) if found else None

    @property
    def notes(self) -> list[str]:
        """What looks wrong, a sentence each."""
        return [note for check in (_depth_notes, _camera_notes, _cloud_notes, _frame_notes) for note in check(self)]

    def to_dict(self) -> dict[str, Any]:
        """What --json prints."""
        return {
            "schema": SCHEMA,
            "input": {"path": self.path, "format": self.format, "frames": self.total, "parts": list(self.parts)},
            "selection": self.selection,
            "frames": self.frames,
            "names": self.names and list(self.names),
            "timing": self.timing and asdict(self.timing),
            "depth": self.depth and dict(zip((f"percentile_{p}" for p in PERCENTILES), self.depth, strict=True)),
            "missing": self.missing,
            "notes": self.notes,
            "sampled": [asdict(look) for look in self.looks],
        }


def summarize_capture(
    capture: Capture, samples: int, see: Callable[[Look, FrameData | None], None] = lambda look, shot: None
) -> Summary:
    """Look at up to `samples` frames of a capture, evenly from the first to the last, one in memory at a time.

    see : called with each look and its shot, None where it cannot be read.
    """
    count = len(capture.frames)
    looks = []
    numbers: list[int] = getattr(capture, "indices", None) or list(range(count))
    for i in np.unique(np.rint(np.linspace(0, count - 1, min(samples, count))).astype(int)).tolist() if count else []:
        look, shot = _look(numbers[i], capture.frames[i])
        looks.append(look)
        see(look, shot)
    whole: Capture = getattr(capture, "whole", capture)
    return Summary(
        path=str(capture.path),
        format=capture.format,
        frames=count,
        total=len(whole.frames),
        selection=getattr(capture, "selection", ""),
        names=(capture.frames[0].name, capture.frames[-1].name) if count else None,
        parts=tuple(getattr(whole, "parts", ())),
        timing=_timing(capture),
        looks=tuple(looks),
    )


def _look(index: int, entry: FrameRef) -> tuple[Look, FrameData | None]:
    try:
        shot = entry.load()
    except InputError as error:
        return Look(index, entry.name, entry.timestamp, str(error)), None
    known: dict[str, Any] = {"mask": shot.mask is not None, "pose": shot.pose is not None}
    data = shot.data
    if isinstance(data, Cloud):
        low, high = (tuple(getattr(data.points, end)(axis=0).tolist()) for end in ("min", "max"))
        known |= {"kind": "cloud", "color": data.colors is not None, "viewpoint": data.viewpoint is not None}
        known |= {"points": len(data.points), "low": low, "high": high}
    elif isinstance(data, Frame):
        known |= {"kind": "depth", "size": data.depth.shape[::-1], "camera": data.camera, "color": data.color is not None}
        known |= {"depth": _percentiles(data.depth[data.depth > 0]), "missing": float((data.depth == 0).mean())}
    else:
        known |= {"kind": "image", "size": data.color.shape[1::-1], "color": True}
    return Look(index, entry.name, entry.timestamp, **known), shot


def _percentiles(depth: Floats) -> tuple[float, ...] | None:
    return tuple(np.percentile(depth, PERCENTILES).tolist()) if len(depth) else None


def _timing(capture: Capture) -> Timing | None:
    stamped = [(entry.timestamp, entry.name) for entry in capture.frames if entry.timestamp is not None]
    if not stamped:
        return None
    times = np.array([stamp for stamp, _ in stamped])
    steps = np.diff(times)
    usual = float(np.median(steps)) if len(steps) else 0.0
    longest = int(np.argmax(steps)) if len(steps) else None
    return Timing(
        first=float(times.min()),
        last=float(times.max()),
        rate=1 / usual if usual > 0 else None,
        longest=None if longest is None else float(steps[longest]),
        longest_after=None if longest is None else stamped[longest][1],
    )


def _depth_notes(summary: Summary) -> list[str]:
    if summary.depth is None:
        empty = [look for look in summary.good if look.kind == "depth"]
        return ["no frame that was looked at has any depth"] if empty else []
    median, (near, far) = summary.depth[1], MEASURED
    if near <= median <= far:
        return []
    wrong, factor = ("large", median) if median > far else ("small", 1 / median)
    return [
        f"the median depth is {median:.4g} m, too {wrong} for a depth camera, as if the unit were wrong by some {factor:.0g}: "
        "check the units per metre (--input-option depth_scale=...; 1000 for millimetres)"
    ]


def _camera_notes(summary: Summary) -> list[str]:
    notes = []
    cameras = {look.camera for look in summary.good if look.camera is not None}
    for camera in sorted(cameras, key=lambda camera: (camera.width, camera.fx)):
        across = camera.fx / camera.width
        if not WIDEST <= across <= NARROWEST:
            notes.append(
                f"a focal length of {camera.fx:.0f} px for {camera.width} px of width is unlikely: is it of this resolution?"
            )
        elif not (0.25 < camera.cx / camera.width < 0.75 and 0.25 < camera.cy / camera.height < 0.75):
            notes.append(
                f"the principal point ({camera.cx:.0f}, {camera.cy:.0f}) lies far from the middle of "
                f"{camera.width}x{camera.height} px: are the intrinsics of this resolution?"
            )
    if len({look.size for look in summary.good}) > 1:
        notes.append("the frames are of several sizes")
    return notes


def _cloud_notes(summary: Summary) -> list[str]:
    notes = []
    for look in summary.good:
        if look.low is not None and look.high is not None:
            across = float(np.linalg.norm(np.subtract(look.high, look.low)))
            if not CLOUD[0] <= across <= CLOUD[1]:
                notes.append(f"{look.name} is {across:.4g} m across: are its coordinates metres? (they have to be)")
    return notes[:1]


def _frame_notes(summary: Summary) -> list[str]:
    timing, notes = summary.timing, list[str]()
    if timing and timing.longest and timing.rate and timing.longest * timing.rate > _GAP:
        notes.append(f"after {timing.longest_after} there is no frame for {timing.longest:.3g} s")
    if failed := [look for look in summary.looks if look.error is not None]:
        notes.append(f"{len(failed)} of the {len(summary.looks)} frames that were looked at cannot be read")
    return notes

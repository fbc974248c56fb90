"""Summarize a capture, from its frame references and the data of a few of its frames."""

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ..errors import InputError
from ..types import Camera, Cloud, Frame
from ..types.plausibility import topic_of
from ..types.plausibility.camera import camera_notes
from ..types.plausibility.depth_unit import depth_samples, depth_step, unit_notes
from ..types.plausibility.registration import ColorShift, color_shift, registration_notes
from .capture import Capture, FrameData, FrameRef

SCHEMA = "doo3d/info/2"
PERCENTILES = (1, 50, 99)  # of the depth; the extremes themselves are often single wrong measurements
CLOUD_SIZE_RANGE_M = (0.01, 200.0)  # diagonal of a plausible cloud with a cable in it
_MAX_STEP_MEDIANS = 3.0  # median time steps; a longer step between two frames gives a warning


@dataclass(frozen=True)
class FrameSummary:
    """The content of one frame that was loaded for the summary of its capture.

    Attributes
    ----------
    index, name, timestamp
        the frame's number in the whole capture from 0, its name, its time in s or None.
    error
        the reason why the frame cannot be read, in which case all fields below keep their defaults; None if it can be read.
    kind
        "depth", "cloud" or "image".
    size
        (width, height) px; None for clouds.
    camera
        the pinhole camera of a depth frame.
    color, mask, pose, viewpoint
        whether the frame has color, a mask, a camera pose, a sensor position (of a cloud).
    depth
        1st, 50th and 99th percentile of the measured depth, m; None if no pixel has depth.
    depth_step
        resolution of the depth, mm: the length of which all sampled depths are multiples; None if it is below 0.1 mm.
    missing
        share of the pixels without depth, 0 to 1; None for clouds and images.
    color_shift
        shift of the color against the depth, from their edges; None if the edges are not conclusive.
    points
        number of points of a cloud.
    low, high
        least and greatest x, y, z of a cloud's points, m, in the cloud's coordinates.
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
    depth_step: float | None = None
    missing: float | None = None
    color_shift: ColorShift | None = None
    points: int | None = None
    low: tuple[float, float, float] | None = None
    high: tuple[float, float, float] | None = None


@dataclass(frozen=True)
class Timing:
    """The times of a capture's frames.

    Attributes
    ----------
    first, last
        earliest and latest time, s.
    rate
        frames per second: 1 / the median step between successive frames; None if that step is not above zero.
    longest
        longest step between two successive frames, s; None for a single frame.
    longest_after
        name of the frame before the longest step.
    """

    first: float
    last: float
    rate: float | None
    longest: float | None
    longest_after: str | None


@dataclass(frozen=True)
class CaptureSummary:
    """Format, frames and times of a capture, with the content of a few frames loaded as a check.

    Attributes
    ----------
    path, format
        path and format of the capture; `format` is a key of `doo3d.inputs.FORMATS`.
    frames
        number of selected frames.
    total
        number of frames of the whole capture.
    selection
        the selection as on the command line, such as "--every 5"; empty if all frames are selected.
    names
        names of the first and of the last selected frame; None without frames.
    topics
        a line of text for each topic or stream; empty if the format has none (only bags have).
    timing
        times of the selected frames; None if no frame has one.
    checked
        summaries of the frames that were loaded, in recording order.
    notes
        a sentence for each assumption and repair made while reading the capture.
    frame_notes
        sentences about implausible data of one frame and its chains, from `doo3d.types.plausibility`.
    """

    path: str
    format: str
    frames: int
    total: int
    selection: str
    names: tuple[str, str] | None
    topics: tuple[str, ...]
    timing: Timing | None
    checked: tuple[FrameSummary, ...]
    notes: tuple[str, ...] = ()
    frame_notes: tuple[str, ...] = ()

    @property
    def readable(self) -> list[FrameSummary]:
        """The checked frames that could be read, in recording order."""
        return [frame for frame in self.checked if frame.error is None]

    @property
    def depth(self) -> tuple[float, float, float] | None:
        """Range of the depth over the checked frames: (near, median, far) in m; None if no frame has depth.

        Over all frames, `near` is the least 1st percentile of a frame, `median` the median of the frames' medians, and `far` the
        greatest 99th percentile of a frame.
        """
        depths = np.array([frame.depth for frame in self.readable if frame.depth is not None])
        return (float(depths[:, 0].min()), float(np.median(depths[:, 1])), float(depths[:, 2].max())) if len(depths) else None

    @property
    def missing(self) -> float | None:
        """Share of pixels without depth, 0 to 1, averaged over the checked depth frames; None if no checked frame has depth."""
        shares = [frame.missing for frame in self.readable if frame.missing is not None]
        return float(np.mean(shares)) if shares else None

    @property
    def warnings(self) -> list[str]:
        """Warnings about the capture, one sentence each; empty if nothing looks wrong.

        There are warnings for implausible depth units, intrinsics and cloud sizes, color that is not registered to the depth,
        frames of different sizes, long gaps in time, frames that cannot be read, and the further `frame_notes`.
        """
        checks = (_depth_warnings, _camera_warnings, _color_warnings, _cloud_warnings, _frame_warnings)
        warnings = [warning for check in checks for warning in check(self)]
        topics = {topic_of(warning) for warning in warnings}
        return warnings + [note for note in self.frame_notes if topic_of(note) not in topics]

    def to_dict(self) -> dict[str, Any]:
        """Return the summary as the JSON object that `doo3d info --json` prints, of schema "doo3d/info/2"."""
        return {
            "schema": SCHEMA,
            "input": {"path": self.path, "format": self.format, "frames": self.total, "topics": list(self.topics)},
            "selection": self.selection,
            "frames": self.frames,
            "names": self.names and list(self.names),
            "timing": self.timing and asdict(self.timing),
            "depth": self.depth and dict(zip((f"percentile_{p}" for p in PERCENTILES), self.depth, strict=True)),
            "missing": self.missing,
            "notes": list(self.notes),
            "warnings": self.warnings,
            "checked": [asdict(frame) for frame in self.checked],
        }


def summarize_capture(
    capture: Capture, samples: int, visit: Callable[[FrameSummary, FrameData | None], None] = lambda frame, data: None
) -> CaptureSummary:
    """Load up to `samples` evenly spaced frames of a capture and return the summary of the capture.

    Only one frame is in memory at a time. If a frame cannot be read, its summary has the reason; no error is raised.

    Parameters
    ----------
    capture
        the capture, or a selection of its frames.
    samples
        largest number of frames to load. The first and the last frame are among them if `samples` is 2 or more.
    visit
        function called once per loaded frame with its summary and its data, or None instead of the data if it cannot be read.
    """
    count = len(capture.frames)
    checked = []
    numbers = capture.indices or range(count)
    for i in np.unique(np.rint(np.linspace(0, count - 1, min(samples, count))).astype(int)).tolist() if count else []:
        summary, data = _summarize_frame(numbers[i], capture.frames[i])
        checked.append(summary)
        visit(summary, data)
    return CaptureSummary(
        path=str(capture.path),
        format=capture.format,
        frames=count,
        total=len(capture.whole or capture),
        selection=capture.selection or "",
        names=(capture.frames[0].name, capture.frames[-1].name) if count else None,
        topics=tuple(capture.topics),
        timing=_timing(capture),
        checked=tuple(checked),
        notes=tuple(capture.notes),
    )


def _summarize_frame(index: int, frame: FrameRef) -> tuple[FrameSummary, FrameData | None]:
    try:
        loaded = frame.load()
    except InputError as error:
        return FrameSummary(index, frame.name, frame.timestamp, str(error)), None
    values: dict[str, Any] = {"mask": loaded.mask is not None, "pose": loaded.pose is not None}
    data = loaded.data
    if isinstance(data, Cloud):
        low, high = (tuple(getattr(data.points, end)(axis=0).tolist()) for end in ("min", "max"))
        values |= {"kind": "cloud", "color": data.colors is not None, "viewpoint": data.viewpoint is not None}
        values |= {"points": len(data.points), "low": low, "high": high}
    elif isinstance(data, Frame):
        measured = data.depth[data.depth > 0]
        depth = tuple(np.percentile(measured, PERCENTILES).tolist()) if len(measured) else None
        values |= {"kind": "depth", "size": data.depth.shape[::-1], "camera": data.camera, "color": data.color is not None}
        values |= {"depth": depth, "missing": float((data.depth == 0).mean())}
        values |= {"depth_step": depth_step(depth_samples(data.depth)), "color_shift": color_shift(data)}
    else:
        values |= {"kind": "image", "size": data.color.shape[1::-1], "color": True}
    return FrameSummary(index, frame.name, frame.timestamp, **values), loaded


def _timing(capture: Capture) -> Timing | None:
    stamped = [(frame.timestamp, frame.name) for frame in capture.frames if frame.timestamp is not None]
    if not stamped:
        return None
    times = np.array([stamp for stamp, _ in stamped])
    steps = np.diff(times)
    if not len(steps):
        return Timing(float(times[0]), float(times[0]), None, None, None)
    median, longest = float(np.median(steps)), int(np.argmax(steps))
    rate = 1 / median if median > 0 else None
    return Timing(float(times.min()), float(times.max()), rate, float(steps[longest]), stamped[longest][1])


def _depth_warnings(summary: CaptureSummary) -> list[str]:
    if summary.depth is None:
        without = [frame for frame in summary.readable if frame.kind == "depth"]
        return ["none of the checked frames has any depth"] if without else []
    near, median, _ = summary.depth
    steps = {frame.depth_step for frame in summary.readable if frame.depth is not None}
    step = min((each for each in steps if each is not None), default=None) if None not in steps else None
    camera = next(frame.camera for frame in summary.readable if frame.depth is not None)
    return unit_notes(median, near, step, camera, "the median depth")


def _camera_warnings(summary: CaptureSummary) -> list[str]:
    cameras = {frame.camera for frame in summary.readable if frame.camera is not None}
    warnings = [note for camera in sorted(cameras, key=lambda camera: (camera.width, camera.fx)) for note in camera_notes(camera)]
    if len({frame.size for frame in summary.readable}) > 1:
        warnings.append("the frames have different sizes")
    return warnings


def _color_warnings(summary: CaptureSummary) -> list[str]:
    judged = [(frame.color_shift, frame.size) for frame in summary.readable if frame.color_shift is not None]
    width = max((size[0] for _, size in judged if size is not None), default=None)
    return registration_notes([shift for shift, _ in judged], width)


def _cloud_warnings(summary: CaptureSummary) -> list[str]:
    for frame in summary.readable:
        size = None if frame.low is None or frame.high is None else float(np.linalg.norm(np.subtract(frame.high, frame.low)))
        if size is not None and not CLOUD_SIZE_RANGE_M[0] <= size <= CLOUD_SIZE_RANGE_M[1]:
            return [f"the cloud {frame.name} is {size:.4g} m across: coordinates have to be metres, are they?"]
    return []


def _frame_warnings(summary: CaptureSummary) -> list[str]:
    timing, warnings = summary.timing, list[str]()
    if timing and timing.longest and timing.rate and timing.longest * timing.rate > _MAX_STEP_MEDIANS:
        warnings.append(f"there is no frame for {timing.longest:.3g} s after frame {timing.longest_after}")
    if failed := [frame for frame in summary.checked if frame.error is not None]:
        warnings.append(f"{len(failed)} of the {len(summary.checked)} checked frames cannot be read")
    return warnings

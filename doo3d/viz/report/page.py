"""Make the report of a run: one HTML page, from its data and the template beside this file."""

from __future__ import annotations

import html
import json
import os
import re
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from importlib import resources
from pathlib import Path
from typing import Any
from urllib.parse import quote

from ... import __version__
from ...errors import DooError, require
from ...inputs import FrameRef
from ...outputs.detection_json import finite
from ...outputs.frame_status import FrameStatus, frame_statuses, read_picture
from ...outputs.run_reader import Results
from ...types import Detection
from ...types.display import objects_text
from ..palette import doubtful_style
from .packing import pack_chain, pack_cloud, pack_picture

MAX_PICTURE_BYTES, MAX_CLOUD_BYTES = 4_500_000, 5_000_000  # of the page, for all thumbnails and for all clouds
BASE64_RATIO = 3 / 4  # bytes per character of base64
POINT_BYTES = 8  # three coordinates and a color
POINTS_PER_FRAME = (100, 1600)  # at least and at most
MAX_THUMBNAIL_BYTES = 60_000  # if all fit into the page

WithProgress = Callable[[list[FrameStatus]], Iterable[FrameStatus]]


def report_page(results: Results, folder: Path | None = None, clouds: bool = True, with_progress: WithProgress = iter) -> str:
    """Return a report of a run as the text of one self-contained HTML page.

    The page has the key numbers of the run, warnings, plots over the frames, thumbnails of the pictures, and an interactive view
    of each frame's chains. It needs no network.

    Parameters
    ----------
    results
        the results of a finished run, from `open_results`.
    folder
        the folder that the page will be saved in, so that the page can link to the pictures in full size; None for no links.
    clouds
        True shows the points of the capture around the chains. They are read from the capture again; if that fails, the page says
        so.
    with_progress
        called with the list of frames; returns an iterable of the same frames, for example one that shows a progress bar.

    Raises
    ------
    InputError
        the run is not finished, or a file of its results is damaged.
    MissingDependency
        plotly is not installed.
    """
    plotly = require("plotly.offline")
    frames = frame_statuses(results)
    source_points = _CapturePoints(results, len(frames)) if clouds else None
    thumbnail_bytes = min(int(MAX_PICTURE_BYTES * BASE64_RATIO / max(len(frames), 1)), MAX_THUMBNAIL_BYTES)
    pictures = ThreadPoolExecutor(1)  # packed beside the points of the capture
    try:
        packs = pictures.map(lambda frame: _packed_picture(frame, thumbnail_bytes), frames)
        pairs = zip(with_progress(frames), packs, strict=True)
        packed = [_frame_data(frame, results, source_points) | picture for frame, picture in pairs]
    finally:
        pictures.shutdown(cancel_futures=True)
    source = results.manifest.get("input", {})
    manifest_notes = results.manifest.get("notes")
    values = {
        "input": str(source.get("path", "")),
        "format": str(source.get("format", "")),
        "results": str(results.path),
        "version": str(results.manifest.get("versions", {}).get("doo3d", __version__)),
        "pictures": None if folder is None else quote(Path(os.path.relpath(results.path, folder)).as_posix()) + "/",
        "clouds_warning": source_points.warning if source_points else "",
        "notes": [note for note in manifest_notes if isinstance(note, str)] if isinstance(manifest_notes, list) else [],
        "frames": packed,
    }
    parts = {
        "title": html.escape(f"{Path(str(values['input'])).name or results.path.name}: chains"),
        "style": _read_template("page.css"),
        "data": _in_script(json.dumps(finite(values), ensure_ascii=False, allow_nan=False, separators=(",", ":"))),
        "script": _read_template("tube.js") + _read_template("page.js"),
        "plotly": re.sub(r"</(script)", r"<\\/\1", plotly.get_plotlyjs(), flags=re.IGNORECASE),
        "plots": _read_template("plots.js"),
    }
    return re.sub(r"<!--(\w+)-->", lambda match: parts[match[1]], _read_template("page.html"))


def _read_template(name: str) -> str:
    return resources.files(__package__).joinpath(name).read_text(encoding="utf-8")


def _in_script(text: str) -> str:
    """Escape JSON so that it cannot end its script element or start another."""
    return text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")


def _packed_picture(frame: FrameStatus, thumbnail_bytes: int) -> dict[str, Any]:
    """Return the thumbnail of a frame for the page, of at most `thumbnail_bytes`; empty without a picture."""
    picture = None if frame.error is not None else read_picture(frame.picture)
    return (
        {} if picture is None else dict(zip(("picture", "width", "height"), pack_picture(picture, thumbnail_bytes), strict=True))
    )


def _frame_data(frame: FrameStatus, results: Results, points: _CapturePoints | None) -> dict[str, Any]:
    """Return the data of one frame for the page, without its picture.

    Parameters
    ----------
    frame
        status of the frame.
    results
        results of the run.
    points
        points of the capture; None leaves them out.
    """
    values: dict[str, Any] = {
        "name": frame.name,
        "error": frame.error,
        "time": frame.timestamp,
        "seconds": frame.seconds,
        "stages": frame.stages,
        **({"file": frame.picture and frame.picture.name} if frame.error is None else {}),
    }
    if frame.error is not None:
        return values
    detection = results.detection(frame.name)
    segments = sum(len(chain.occluded) for chain in detection.chains)
    occluded = sum(int(chain.occluded.sum()) for chain in detection.chains)
    values |= {
        "mode": detection.mode,
        "coordinates": detection.coordinates,
        "notes": list(detection.notes),
        "occluded": occluded / segments if segments else None,
        "confidence": detection.confidence,
        "chains": [pack_chain(i, chain) for i, chain in enumerate(detection.chains)],
        "doubtful": [pack_chain(i, chain, doubtful_style(chain)) for i, chain in enumerate(detection.doubtful)],
        "crossings": [
            {
                "point": crossing.point.tolist(),
                "upper": crossing.upper.chain,
                "lower": crossing.lower.chain,
                "confidence": crossing.confidence,
            }
            for crossing in detection.crossings
        ],
        **_trees(detection),
    }
    if points is not None and detection.mode == "3d":
        values["cloud"] = points.packed(frame.name, detection)
    return values


def _trees(detection: Detection) -> dict[str, Any]:
    """Return the branched objects of a frame for the page; empty if the detection did not look for them."""
    if not detection.objects:
        return {}
    return {
        "objects": [list(each.chains) for each in detection.objects],
        "objects_text": objects_text(detection.objects),
        "junctions": [
            {
                "position": junction.position.tolist(),
                "ends": [list(end) for end in junction.ends],
                "confidence": junction.confidence,
            }
            for junction in detection.junctions
        ],
    }


class _CapturePoints:
    """The points of a run's capture, read frame by frame.

    warning : why points of some frames are missing; empty if none are.
    """

    def __init__(self, results: Results, frames: int) -> None:
        self.warning = ""
        self._frames: dict[str, FrameRef] = {}
        points = int(MAX_CLOUD_BYTES * BASE64_RATIO / POINT_BYTES / max(frames, 1))
        self._max_points = min(max(points, POINTS_PER_FRAME[0]), POINTS_PER_FRAME[1])
        try:
            self._frames = results.capture_frames(with_masks=False)
        except DooError as error:
            self.warning = f"The capture cannot be read any more, so the chains are shown without their surroundings ({error})."

    def packed(self, name: str, detection: Detection) -> dict[str, Any] | None:
        """Return the packed points of a frame; None if it cannot be read."""
        if name not in self._frames:
            return None
        try:
            return pack_cloud(self._frames[name].load(), detection, self._max_points)
        except DooError as error:
            self.warning = f"Some frames cannot be read any more, so their chains are shown without their surroundings ({error})."
            return None

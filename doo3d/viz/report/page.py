"""The page: what is known of a run, put into the template beside this file."""

from __future__ import annotations

import html
import json
import os
import re
from collections.abc import Callable, Iterable
from importlib import resources
from pathlib import Path
from typing import Any
from urllib.parse import quote

from ... import __version__
from ...errors import DooError, InputError, require
from ...inputs import FrameRef, ReadOptions, open_capture
from ...outputs.detection_json import finite
from ...outputs.frame_status import Told, read_picture, told
from ...outputs.run_reader import Results, read_detection
from .packing import pack_chain, pack_cloud, pack_picture

_PICTURES, _CLOUDS = 4_500_000, 5_000_000  # bytes of the page that all thumbnails, and all clouds, may take
_IN_BASE64 = 3 / 4  # of the bytes
_POINT = 8  # bytes: three coordinates and a colour
_POINTS = (100, 1600)  # of a frame, at least and at most
_LARGEST = 60_000  # bytes of a thumbnail, where there is room for all

Watch = Callable[[list[Told]], Iterable[Told]]


def report_page(results: Results, near: Path | None = None, clouds: bool = True, watch: Watch = iter) -> str:
    """One page of HTML: figures, plots over the frames, thumbnails, and of each frame the chains to turn about.

    Parameters
    ----------
    results : of a finished run.
    near : the folder that the page will be in; it then links to the pictures in full size. None: no links.
    clouds : show points of the capture about the chains, where it still is where it was.
    watch : goes through the frames, for a progress bar.

    Raises
    ------
    InputError : the run is not finished, or a file of it is damaged.
    MissingDependency : plotly is not installed.
    """
    plotly = require("plotly.offline")
    frames = told(results)
    modes = _Clouds(results, len(frames)) if clouds else None
    share = min(int(_PICTURES * _IN_BASE64 / max(len(frames), 1)), _LARGEST)
    packed = [_frame(frame, results, modes, share) for frame in watch(frames)]
    source = results.manifest.get("input", {})
    values = {
        "input": str(source.get("path", "")),
        "format": str(source.get("format", "")),
        "results": str(results.path),
        "version": str(results.manifest.get("versions", {}).get("doo3d", __version__)),
        "pictures": None if near is None else quote(Path(os.path.relpath(results.path, near)).as_posix()) + "/",
        "clouds": modes.said if modes else "",
        "frames": packed,
    }
    parts = {
        "title": html.escape(f"{Path(str(values['input'])).name or results.path.name}: chains"),
        "style": _file("page.css"),
        "data": _in_script(json.dumps(finite(values), ensure_ascii=False, allow_nan=False, separators=(",", ":"))),
        "script": _file("tube.js") + _file("page.js"),
        "plotly": re.sub(r"</(script)", r"<\\/\1", plotly.get_plotlyjs(), flags=re.IGNORECASE),
        "plots": _file("plots.js"),
    }
    return re.sub(r"<!--(\w+)-->", lambda found: parts[found[1]], _file("page.html"))


def _file(name: str) -> str:
    return resources.files(__package__).joinpath(name).read_text(encoding="utf-8")


def _in_script(text: str) -> str:
    """JSON that no part of can end the script element that it is in, nor begin another."""
    return text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")


def _frame(frame: Told, results: Results, clouds: _Clouds | None, share: int) -> dict[str, Any]:
    known: dict[str, Any] = {
        "name": frame.name,
        "error": frame.error,
        "time": frame.timestamp,
        "seconds": frame.seconds,
        "stages": frame.stages,
    }
    if frame.error is not None:
        return known
    detection = read_detection(results.path / f"{frame.name}.json")
    segments = sum(len(chain.occluded) for chain in detection.chains)
    hidden = sum(int(chain.occluded.sum()) for chain in detection.chains)
    known |= {
        "mode": detection.mode,
        "coordinates": detection.coordinates,
        "notes": list(detection.notes),
        "occluded": hidden / segments if segments else None,
        "confidence": detection.confidence,
        "chains": [pack_chain(i, chain) for i, chain in enumerate(detection.chains)],
        "crossings": [
            {
                "at": crossing.point.tolist(),
                "upper": crossing.upper.chain,
                "lower": crossing.lower.chain,
                "confidence": crossing.confidence,
            }
            for crossing in detection.crossings
        ],
    }
    if (picture := read_picture(frame.picture)) is not None:
        known["picture"], known["width"], known["height"] = pack_picture(picture, share)
    if clouds is not None and detection.mode == "3d":
        known["cloud"] = clouds.of(frame.name, detection)
    return known


class _Clouds:
    """The capture that was run on, opened again.

    said : why frames are without points; empty where none is.
    """

    def __init__(self, results: Results, frames: int) -> None:
        self.said = ""
        self._entries: dict[str, FrameRef] = {}
        self._count = min(max(int(_CLOUDS * _IN_BASE64 / _POINT / max(frames, 1)), _POINTS[0]), _POINTS[1])
        source = results.manifest.get("input", {})
        try:
            capture = open_capture(source["path"], options=ReadOptions(**source.get("reading", {})))
            if capture.format != source.get("format"):
                raise InputError(f"{source['path']}: is a capture of another format now", code="input-changed")
            self._entries = {entry.name: entry for entry in capture.frames}
        except (DooError, KeyError, TypeError, ValueError) as error:
            self.said = f"The capture cannot be read any more, so chains are shown without their surroundings ({error})."

    def of(self, name: str, detection: Any) -> dict[str, Any] | None:
        """The points of a frame; None where it cannot be read."""
        if name not in self._entries:
            return None
        try:
            return pack_cloud(self._entries[name].load(), detection, self._count)
        except DooError as error:
            self.said = f"Some frames cannot be read any more, so their chains are shown without their surroundings ({error})."
            return None

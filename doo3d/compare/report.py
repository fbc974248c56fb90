"""A whole capture both ways: a line, a picture and an entry in `comparison.json` for each frame."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from ..config import Config
from ..errors import InputError, describe_error, error_code
from ..inputs import IMAGE_FORMATS, Capture, FrameRef
from ..outputs.atomic import write_bytes, write_text
from ..outputs.detection_json import dumps
from ..types import Frame
from ..viz.comparison import draw_comparison
from .agreement import Comparison, compare

SCHEMA, SUMMARY = "doo3d/comparison/1", "comparison.json"
_SHOWN = 6  # places that are printed of a frame


@dataclass(frozen=True)
class Record:
    """What became of one frame: a comparison, or the reason why there is none, a sentence, and the code of that error."""

    name: str
    comparison: Comparison | None = None
    error: str | None = None
    code: str | None = None

    @property
    def agrees(self) -> bool:
        """Compared, and the same both ways."""
        return self.comparison is not None and self.comparison.agrees

    def lines(self, column: int = 0) -> list[str]:
        """For people; the name is filled up to `column` characters."""
        if self.comparison is None:
            return [f"{self.name:<{column}}   failed: {self.error} [{self.code}]"]
        found = self.comparison
        word = "agree  " if found.agrees else "differ "
        gaps = ""
        if np.isfinite(found.largest):
            gaps = f"   largest distance {found.largest:.1f} px ({found.tolerance:.1f} allowed)   RMS {found.rms:.1f} px"
        head = f"{self.name:<{column}}   {word}   chains {len(found.solid)} in 3-D, {len(found.flat)} in 2-D{gaps}"
        told = [f"{'':<{column}}   at ({place.at[0]:.0f}, {place.at[1]:.0f}): {place.what}" for place in found.places[:_SHOWN]]
        more = len(found.places) - _SHOWN
        return [head, *told, *([f"{'':<{column}}   and {more} more, see {SUMMARY}"] if more > 0 else [])]


def compare_capture(
    capture: Capture,
    out: Path,
    config: Config,
    flat_config: Config,
    *,
    force: bool = False,
    report: Callable[[Record], None] = lambda record: None,
) -> list[Record]:
    """Compare every frame of a capture with depth and write what was found.

    Parameters
    ----------
    capture : from `open_capture`. out : the folder for `<frame>.png` and `comparison.json`, made when it is first needed.
    config, flat_config : of the 3-D and of the 2-D mode. force : write into `out` though it holds something else.
    report : called with each frame's record when it is done.

    Raises
    ------
    InputError : the capture has no depth; `out` holds something else, or cannot be written to.
    """
    if capture.format in IMAGE_FORMATS:
        raise InputError(
            f"{capture.path}: images alone give no 3-D, which needs depth/ and camera_intrinsic.json", code="mode-needs-depth"
        )
    if flat_config.mode != "2d" or config.mode == "2d":
        raise InputError("to compare, a 3-D config and a 2-D one are needed, such as default and image", code="config-mode")
    _check_place(out, force)
    records = []
    try:
        for entry in capture.frames:
            records.append(_one(entry, config, flat_config, out))
            report(records[-1])
        if any(record.comparison for record in records):
            write_text(out / SUMMARY, _summary(capture, records))
    except OSError as error:
        raise InputError(f"{out}: cannot be written to ({error.strerror or error})", code="out-unwritable") from None
    return records


def _one(entry: FrameRef, config: Config, flat_config: Config, out: Path) -> Record:
    try:
        shot = entry.load()
        if not isinstance(shot.data, Frame):
            raise InputError(f"{entry.source}: a cloud has no image to compare in", code="mode-needs-image")
        found = compare(shot.data, config, flat_config, shot.mask_for(config))
    except Exception as error:
        return Record(entry.name, error=describe_error(error), code=error_code(error))
    picture = draw_comparison(shot.data, found.solid, found.flat, [(place.at, place.tolerance) for place in found.places])
    out.mkdir(parents=True, exist_ok=True)
    write_bytes(out / f"{entry.name}.png", cv2.imencode(".png", np.ascontiguousarray(picture[:, :, ::-1]))[1].tobytes())
    return Record(entry.name, found)


def _check_place(out: Path, force: bool) -> None:
    if out.exists() and not out.is_dir():
        raise InputError(f"{out}: is a file, expected a folder for the results", code="out-is-file")
    if out.is_dir() and any(out.iterdir()) and not force:
        try:
            ours = json.loads((out / SUMMARY).read_text(encoding="utf-8")).get("schema") == SCHEMA
        except (OSError, ValueError, AttributeError):
            ours = False
        if not ours:
            raise InputError(
                f"{out}: holds something else than a comparison: give another folder with -o, or --force", code="out-foreign"
            )


def _summary(capture: Capture, records: Sequence[Record]) -> str:
    frames = [
        {"name": record.name, "error": record.error, "code": record.code}
        | (record.comparison.to_dict() if record.comparison else {"agrees": None})
        | (record.comparison.to_dict() if record.comparison else {"agrees": None})
        for record in records
    ]
    agree = sum(record.agrees for record in records)
    return dumps({"schema": SCHEMA, "input": str(capture.path.resolve()), "frames": len(records), "agree": agree, "each": frames})

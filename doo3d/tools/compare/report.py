"""Compare the 3-D and the 2-D mode over a capture: a line, a picture and an entry in `comparison.json` per frame."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from ...config import Config
from ...errors import InputError, describe_error, error_code
from ...guard.parsing import read_json
from ...inputs import IMAGE_FORMATS, Capture, FrameRef
from ...outputs.atomic import write_bytes, write_text, writing
from ...outputs.detection_json import dumps
from ...types import Frame
from ...viz.comparison import draw_comparison
from .agreement import Comparison, compare

SCHEMA, SUMMARY = "doo3d/comparison/1", "comparison.json"

_MAX_PRINTED = 6
"""Greatest number of differences that are printed for a frame."""


@dataclass(frozen=True)
class Record:
    """The outcome of comparing one frame: a comparison, or the error that prevented it.

    Attributes
    ----------
    name
        the frame's name.
    comparison
        the comparison; None if the frame failed.
    error, code
        message and machine-readable code of the error, such as "mode-needs-image"; None if the frame was compared.
    """

    name: str
    comparison: Comparison | None = None
    error: str | None = None
    code: str | None = None

    @property
    def agrees(self) -> bool:
        """Whether the 3-D and the 2-D mode agree in the frame; False if the frame failed."""
        return self.comparison is not None and self.comparison.agrees

    def lines(self, column: int = 0) -> list[str]:
        """Return the lines of text to print for this frame.

        The first line holds the frame's name, padded to `column` characters, then "agree" or "differ", the numbers of chains and
        the distances in px, or else the error. A line for each of the first 6 differences follows, and a line with the number of
        the others.
        """
        if self.comparison is None:
            return [f"{self.name:<{column}}   failed: {self.error} [{self.code}]"]
        result = self.comparison
        word = "agree  " if result.agrees else "differ "
        distances = ""
        if np.isfinite(result.max_distance):
            distances = f"   largest distance {result.max_distance:.1f} px ({result.tolerance:.1f} allowed)"
            distances += f"   RMS {result.rms_distance:.1f} px"
        head = f"{self.name:<{column}}   {word}   chains {len(result.lines_3d)} in 3-D, {len(result.lines_2d)} in 2-D{distances}"
        margin = " " * column
        shown = [f"{margin}   at ({item.at[0]:.0f}, {item.at[1]:.0f}): {item.what}" for item in result.differences[:_MAX_PRINTED]]
        more = len(result.differences) - _MAX_PRINTED
        return [head, *shown, *([f"{margin}   and {more} more, see {SUMMARY}"] if more > 0 else [])]


def compare_capture(
    capture: Capture,
    out: Path,
    config: Config,
    config_2d: Config,
    *,
    force: bool = False,
    report: Callable[[Record], None] = lambda record: None,
) -> list[Record]:
    """Compare the 3-D and the 2-D mode in every frame of a capture; write a picture of each frame and `comparison.json`.

    Parameters
    ----------
    capture
        a capture with depth, opened by `doo3d.inputs.open_capture`.
    out
        the folder for `<frame>.png` and `comparison.json`; it is made when the first file is written.
    config, config_2d
        the configurations of the 3-D mode and of the 2-D mode.
    force
        True writes into `out` even if it holds other files than an earlier comparison.
    report
        called with each frame's record as soon as the frame is done.

    Returns
    -------
    A record for each frame, in the capture's order; a frame that fails has a record with the error.

    Raises
    ------
    InputError : the capture has no depth; a config is of the wrong mode; `out` is a file, holds other files, or cannot be
        written to.
    """
    if capture.format in IMAGE_FORMATS:
        raise InputError(
            f"{capture.path}: images alone give no 3-D, which needs depth/ and camera_intrinsic.json", code="mode-needs-depth"
        )
    if config_2d.mode != "2d" or config.mode == "2d":
        raise InputError("to compare, a 3-D config and a 2-D one are needed, such as default and image", code="config-mode")
    _check_folder(out, capture.path, force)
    records = []
    with writing(out):
        for ref in capture.frames:
            records.append(_compare_frame(ref, config, config_2d, out))
            report(records[-1])
        if any(record.comparison for record in records):
            write_text(out / SUMMARY, _summary(capture, records))
    return records


def _compare_frame(ref: FrameRef, config: Config, config_2d: Config, out: Path) -> Record:
    """Compare one frame and write its picture; an error is returned in the record."""
    try:
        frame = ref.load()
        if not isinstance(frame.data, Frame):
            raise InputError(f"{ref.source}: a cloud has no image to compare in", code="mode-needs-image")
        result = compare(frame.data, config, config_2d, frame.mask_for(config))
    except Exception as error:
        return Record(ref.name, error=describe_error(error), code=error_code(error))
    marks = [(difference.at, difference.tolerance) for difference in result.differences]
    picture = draw_comparison(frame.data, result.lines_3d, result.lines_2d, marks)
    out.mkdir(parents=True, exist_ok=True)
    write_bytes(out / f"{ref.name}.png", cv2.imencode(".png", np.ascontiguousarray(picture[:, :, ::-1]))[1].tobytes())
    return Record(ref.name, result)


def _check_folder(out: Path, source: Path, force: bool) -> None:
    """Refuse a folder that holds anything but an earlier comparison of the same capture; `source` is its path."""
    if out.exists() and not out.is_dir():
        raise InputError(f"{out}: is a file, expected a folder for the results", code="out-is-file")
    if out.is_dir() and any(out.iterdir()) and not force:
        try:
            former = read_json(out / SUMMARY)
            is_comparison, former_source = former.get("schema") == SCHEMA, former.get("input")
        except (InputError, AttributeError):
            is_comparison, former_source = False, None
        if is_comparison and former_source != str(source.resolve()):
            raise InputError(
                f"{out}: the folder holds the comparison of another input ({former_source})",
                code="out-other-input",
                remedy="give another folder with -o, or --force to write there nevertheless",
            )
        if not is_comparison:
            raise InputError(
                f"{out}: holds other files than a comparison",
                code="out-foreign",
                remedy="give another folder with -o, or --force to write there nevertheless",
            )


def _summary(capture: Capture, records: Sequence[Record]) -> str:
    """Return the text of `comparison.json`."""
    frames = [
        {"name": record.name, "error": record.error, "code": record.code}
        | (record.comparison.to_dict() if record.comparison else {"agrees": None})
        for record in records
    ]
    agree = sum(record.agrees for record in records)
    return dumps({"schema": SCHEMA, "input": str(capture.path.resolve()), "frames": len(records), "agree": agree, "each": frames})

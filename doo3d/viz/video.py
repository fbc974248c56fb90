"""The pictures of a run as a video."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from ..errors import InputError
from ..outputs.atomic import PREFIX
from ..outputs.frame_status import Told, read_picture, told
from ..outputs.run_reader import Results
from ..types import Array
from .palette import DARK, LIGHT, Rgb

CODECS = ("mp4v", "avc1", "vp09")
FPS = 10.0  # where there are no stamps to take it from
_LIMITS = (1.0, 60.0)  # frames per second taken from stamps
_SIZE = (640, 480)  # px, where there is no picture at all to take it from
_FAILED: Rgb = (255, 120, 110)
_FONT = cv2.FONT_HERSHEY_DUPLEX


@dataclass(frozen=True)
class Video:
    """What was written.

    frames : in it. failed : of the run, shown or left out. fps : frames per second. size : (width, height) px.
    """

    frames: int
    failed: int
    fps: float
    size: tuple[int, int]


def write_video(
    results: Results,
    path: Path,
    fps: float | None = None,
    codec: str = "mp4v",
    skip_failed: bool = False,
    watch: Callable[[list[Told]], Iterable[Told]] = iter,
) -> Video:
    """Write the pictures of a run one after the other.

    The size is that of the first picture; others are made to fit, with black beside or above. A frame that failed is a dark
    picture with its name and reason.

    Parameters
    ----------
    results : of a finished run. path : the file, MP4.
    fps : frames per second; None: the median of what the stamps say, 10 without them.
    codec : mp4v (MPEG-4), vp09 (VP9, which browsers play, slower to make), or avc1 (H.264, which not every OpenCV can make).
    skip_failed : leave frames that failed out. watch : goes through the frames, for a progress bar.

    Raises
    ------
    InputError : there is nothing to show, a picture is gone, the codec is not there, or the file cannot be written.
    """
    if codec not in CODECS:
        raise InputError(f"codec {codec}: there are {', '.join(CODECS)}", code="choice-unknown")
    if fps is not None and not (np.isfinite(fps) and fps > 0):
        raise InputError(f"fps {fps}: expected a number above zero", code="value-out-of-bounds")
    every = told(results)
    frames = [frame for frame in every if not (skip_failed and frame.error is not None)]
    if not frames:
        raise InputError(f"{results.path}: holds no frame to show", code="results-empty")
    fps = fps or _fps([frame.timestamp for frame in every])
    size = _size(frames)
    temporary = path.absolute().parent / f"{PREFIX}{path.stem}.mp4"
    try:
        _write(frames, temporary, fps, codec, size, watch)
        temporary.replace(path)
    except OSError as error:
        raise InputError(f"{path}: cannot be written to ({error.strerror})", code="out-unwritable") from None
    finally:
        temporary.unlink(missing_ok=True)
    return Video(len(frames), sum(frame.error is not None for frame in every), fps, size)


def _write(
    frames: list[Told],
    path: Path,
    fps: float,
    codec: str,
    size: tuple[int, int],
    watch: Callable[[list[Told]], Iterable[Told]],
) -> None:
    with path.open("wb"):
        pass  # a folder that may not be written to is an OSError, of which OpenCV says nothing
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*codec), fps, size)
    try:
        if not writer.isOpened():
            raise InputError(
                f"codec {codec}: this OpenCV cannot make it; mp4v (--codec mp4v) is always there", code="codec-unsupported"
            )
        for frame in watch(frames):
            writer.write(_picture(frame, size))
    finally:
        writer.release()


def _picture(frame: Told, size: tuple[int, int]) -> Array:
    """(H, W, 3) uint8 BGR."""
    if frame.error is not None:
        return failed_card(frame.name, frame.error, size)
    picture = read_picture(frame.picture)
    if picture is None:
        raise InputError(
            f"{frame.picture}: is gone or damaged, and the video is made from it; run doo3d detect again", code="picture-missing"
        )
    return letterboxed(picture, size)


def _size(frames: list[Told]) -> tuple[int, int]:
    """(width, height) px of the first picture, less a pixel where that is odd: codecs want them even."""
    for frame in frames:
        if frame.error is None and (picture := read_picture(frame.picture)) is not None:
            height, width = picture.shape[:2]
            return max(2, width - width % 2), max(2, height - height % 2)
    return _SIZE


def _fps(stamps: Sequence[float | None]) -> float:
    """From the median step between stamps that grow."""
    known = [stamp for stamp in stamps if stamp is not None]
    steps = np.diff(known)
    steps = steps[steps > 0]
    if not len(steps):
        return FPS
    return float(np.clip(round(1 / float(np.median(steps)), 2), *_LIMITS))


def letterboxed(picture: Array, size: tuple[int, int]) -> Array:
    """(H, W, 3) uint8 -> (height, width, 3) of `size` (width, height): as large as fits, black round it."""
    width, height = size
    if picture.shape[:2] in ((height, width), (height + 1, width), (height, width + 1), (height + 1, width + 1)):
        return np.ascontiguousarray(picture[:height, :width])
    scale = min(width / picture.shape[1], height / picture.shape[0])
    inner = (min(width, max(1, round(picture.shape[1] * scale))), min(height, max(1, round(picture.shape[0] * scale))))
    sheet = np.zeros((height, width, 3), np.uint8)
    left, top = (width - inner[0]) // 2, (height - inner[1]) // 2
    way = cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR
    sheet[top : top + inner[1], left : left + inner[0]] = cv2.resize(picture, inner, interpolation=way)
    return sheet


def failed_card(name: str, reason: str, size: tuple[int, int]) -> Array:
    """(height, width, 3) uint8 BGR: a dark picture that says which frame failed, and why; as much of it as there is room for."""
    width, height = size
    sheet = np.full((height, width, 3), DARK[::-1], np.uint8)
    text_size = max(0.3, 0.9 * min(width, 1.5 * height) / 1280)
    (letter, tall), _ = cv2.getTextSize("n", _FONT, text_size, 1)
    row, margin = round(2.6 * tall), width // 16
    columns = max(8, (width - 2 * margin) // max(1, letter))
    lines = [
        f"{name}: failed",
        *textwrap.wrap(reason, columns, max_lines=max(1, (height - 2 * margin) // row - 1), placeholder=" ..."),
    ]
    top = max(row, (height - row * len(lines)) // 2)
    for i, line in enumerate(lines):
        color = (_FAILED if not i else LIGHT)[::-1]
        # the font has ASCII alone
        plain = line.encode("ascii", "replace").decode()
        cv2.putText(sheet, plain, (margin, top + i * row), _FONT, text_size, color, 1, cv2.LINE_AA)
    return sheet

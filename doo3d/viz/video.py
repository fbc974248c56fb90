"""Write the pictures of a run as a video."""

import textwrap
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from ..errors import InputError
from ..inputs.support.native_output import capture_native_output
from ..outputs.atomic import PREFIX, writing
from ..outputs.frame_status import FrameStatus, frame_statuses, read_picture
from ..outputs.run_reader import Results
from ..types import Array
from .palette import DARK, LIGHT, Rgb

CODECS = ("mp4v", "avc1", "vp08", "vp09")
WEBM = ".webm"
_FOURCC_IN_WEBM = {"vp08": "VP80", "vp09": "VP90"}
_TRACK_UID = b"\x73\xc5\x88"  # in WebM: begins an id of 8 bytes, which OpenCV's FFmpeg draws at random
_WEBM_HEAD_BYTES = 4096
DEFAULT_FPS = 10.0  # without timestamps
_FPS_LIMITS = (1.0, 60.0)  # of a rate from timestamps
_DEFAULT_SIZE = (640, 480)  # px, without any picture
_FAILED: Rgb = (255, 120, 110)
_FONT = cv2.FONT_HERSHEY_DUPLEX


@dataclass(frozen=True)
class Video:
    """Facts about a video that was written.

    Attributes
    ----------
    frames
        number of frames in the video.
    failed
        number of failed frames of the run, whether the video shows or skips them.
    undrawn
        number of frames without a picture, which the video skips.
    fps
        frames per second.
    size
        (width, height) px.
    """

    frames: int
    failed: int
    undrawn: int
    fps: float
    size: tuple[int, int]


def write_video(
    results: Results,
    path: Path,
    fps: float | None = None,
    codec: str | None = None,
    skip_failed: bool = False,
    with_progress: Callable[[list[FrameStatus]], Iterable[FrameStatus]] = iter,
) -> Video:
    """Write the pictures of a run as a video; an existing file is replaced.

    The video has the size of the first picture, rounded down to even numbers. Pictures of another size are scaled to fit, with
    black bars. A failed frame is shown as a dark picture with the frame's name and the reason. Frames without a picture are
    left out.

    Parameters
    ----------
    results
        the results of a finished run, from `open_results`.
    path
        the file to write: WebM if its suffix is .webm, MP4 otherwise.
    fps
        frames per second, above 0; None takes the rate from the median step of the frames' timestamps (at least 1, at most 60),
        or 10 without timestamps.
    codec
        "mp4v" (MPEG-4), "vp08" or "vp09" (VP8 and VP9, which browsers play; VP9 has half the size and takes three times as long),
        or "avc1" (H.264, which not every OpenCV encodes). WebM holds VP8 and VP9 only. None takes VP8 for WebM, MPEG-4 for MP4.
    skip_failed
        True leaves failed frames out of the video.
    with_progress
        called with the list of frames; returns an iterable of the same frames, for example one that shows a progress bar.

    Returns
    -------
    Video
        numbers of frames, of failed ones and of those without a picture, rate and size of the video.

    Raises
    ------
    InputError
        the run is not finished, there is no frame to show, a picture is missing, `fps` is not above 0, the codec is not
        available, or the file cannot be written.
    """
    suffix = WEBM if path.suffix.lower() == WEBM else ".mp4"
    codec = codec or ("vp08" if suffix == WEBM else "mp4v")
    if codec not in CODECS:
        raise InputError(f"codec {codec}: unknown, choose one of {', '.join(CODECS)}", code="choice-unknown")
    if suffix == WEBM and codec not in _FOURCC_IN_WEBM:
        raise InputError(
            f"{path}: WebM cannot hold {codec}; give a name that ends in .mp4, or --codec vp08", code="options-conflict"
        )
    if fps is not None and not (np.isfinite(fps) and fps > 0):
        raise InputError(f"fps {fps}: expected a number above zero", code="value-out-of-bounds")
    statuses = frame_statuses(results)
    frames = [frame for frame in statuses if frame.picture is not None or (frame.error is not None and not skip_failed)]
    undrawn = sum(frame.picture is None and frame.error is None for frame in statuses)
    if undrawn and all(frame.picture is None for frame in frames):
        remedy = "repeat the doo3d detect command with --pictures all"
        raise InputError(f"{results.path}: holds no pictures to show, none were drawn", code="picture-missing", remedy=remedy)
    if not frames:
        raise InputError(f"{results.path}: holds no frame to show", code="results-empty")
    fps = fps or _rate([frame.timestamp for frame in statuses])
    size = _size(frames)
    temporary = path.absolute().parent / f"{PREFIX}{path.stem}{suffix}"
    try:
        with writing(path):
            _write(frames, temporary, fps, codec, size, with_progress)
            temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)
    return Video(len(frames), sum(frame.error is not None for frame in statuses), undrawn, fps, size)


def _write(
    frames: list[FrameStatus],
    path: Path,
    fps: float,
    codec: str,
    size: tuple[int, int],
    with_progress: Callable[[list[FrameStatus]], Iterable[FrameStatus]],
) -> None:
    with path.open("wb"):
        pass  # raises OSError in a read-only folder, where OpenCV fails silently
    fourcc = _FOURCC_IN_WEBM[codec] if path.suffix == WEBM else codec
    with capture_native_output():  # a remark on the letters that name the codec
        writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*fourcc), fps, size)
    try:
        if not writer.isOpened():
            remedy = "give a name that ends in .mp4" if path.suffix == WEBM else "use --codec mp4v"
            raise InputError(f"codec {codec}: this OpenCV cannot encode it in {path.suffix}; {remedy}", code="codec-unsupported")
        for frame in with_progress(frames):
            writer.write(_picture(frame, size))
    finally:
        writer.release()
    if path.suffix == WEBM:
        _set_track_id(path)


def _set_track_id(path: Path) -> None:
    """Replace the random id of the track in a WebM file by 1, so that the same pictures give the same bytes."""
    with path.open("r+b") as file:
        head = file.read(_WEBM_HEAD_BYTES)
        at = head.find(_TRACK_UID)
        if at < 0:
            return
        start = at + len(_TRACK_UID)
        file.seek(0)
        file.write(head.replace(head[start : start + 8], (1).to_bytes(8, "big")))


def _picture(frame: FrameStatus, size: tuple[int, int]) -> Array:
    """Return the picture of a frame, (H, W, 3) uint8 BGR."""
    if frame.error is not None:
        return failed_card(frame.name, frame.error, size)
    picture = read_picture(frame.picture)
    if picture is None:
        raise InputError(f"{frame.picture}: is missing or damaged; run doo3d detect again", code="picture-missing")
    return letterboxed(picture, size)


def _size(frames: list[FrameStatus]) -> tuple[int, int]:
    """Return (width, height) px of the first picture, rounded down to even numbers, which codecs require."""
    for frame in frames:
        if frame.error is None and (picture := read_picture(frame.picture)) is not None:
            height, width = picture.shape[:2]
            return max(2, width - width % 2), max(2, height - height % 2)
    return _DEFAULT_SIZE


def _rate(timestamps: Sequence[float | None]) -> float:
    """Return frames per second from the median positive step of timestamps in s."""
    steps = np.diff([stamp for stamp in timestamps if stamp is not None])
    steps = steps[steps > 0]
    if not len(steps):
        return DEFAULT_FPS
    return float(np.clip(round(1 / float(np.median(steps)), 2), *_FPS_LIMITS))


def letterboxed(picture: Array, size: tuple[int, int]) -> Array:
    """Return a picture scaled to fit into a given size, centered, with black bars where it does not fill it: uint8, 3 channels.

    A picture that is at most one pixel larger is cropped instead.

    Parameters
    ----------
    picture
        (H, W, 3) uint8.
    size
        (width, height) px of the result.
    """
    width, height = size
    if picture.shape[:2] in ((height, width), (height + 1, width), (height, width + 1), (height + 1, width + 1)):
        return np.ascontiguousarray(picture[:height, :width])
    scale = min(width / picture.shape[1], height / picture.shape[0])
    inner = (min(width, max(1, round(picture.shape[1] * scale))), min(height, max(1, round(picture.shape[0] * scale))))
    sheet = np.zeros((height, width, 3), np.uint8)
    left, top = (width - inner[0]) // 2, (height - inner[1]) // 2
    interpolation = cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR
    sheet[top : top + inner[1], left : left + inner[0]] = cv2.resize(picture, inner, interpolation=interpolation)
    return sheet


def failed_card(name: str, reason: str, size: tuple[int, int]) -> Array:
    """Return a dark picture, (height, width, 3) uint8 BGR, with the name of a failed frame and the reason of the failure.

    Parameters
    ----------
    name
        name of the frame.
    reason
        text, wrapped to the width of the picture, and cut off if it is too long.
    size
        (width, height) px of the picture.
    """
    width, height = size
    sheet = np.full((height, width, 3), DARK[::-1], np.uint8)
    text_size = max(0.3, 0.9 * min(width, 1.5 * height) / 1280)
    (letter_width, letter_height), _ = cv2.getTextSize("n", _FONT, text_size, 1)
    row, margin = round(2.6 * letter_height), width // 16
    columns = max(8, (width - 2 * margin) // max(1, letter_width))
    lines = [
        f"{name}: failed",
        *textwrap.wrap(reason, columns, max_lines=max(1, (height - 2 * margin) // row - 1), placeholder=" ..."),
    ]
    top = max(row, (height - row * len(lines)) // 2)
    for i, line in enumerate(lines):
        color = (_FAILED if not i else LIGHT)[::-1]
        # the font has only ASCII
        ascii_text = line.encode("ascii", "replace").decode()
        cv2.putText(sheet, ascii_text, (margin, top + i * row), _FONT, text_size, color, 1, cv2.LINE_AA)
    return sheet

"""Read video files for the 2-D mode, decoded by OpenCV and FFmpeg frame by frame."""

import re
from dataclasses import dataclass
from functools import lru_cache, partial
from pathlib import Path
from threading import Lock
from typing import ClassVar

import cv2
import numpy as np

from ...errors import InputError
from ...guard.guarding import read_head
from ...guard.limits import check_pixels
from ...types import Array, Image
from ..capture import FrameData, FrameRef
from ..read_options import DEFAULT, ReadOptions
from ..support.native_output import capture_native_output

SUFFIXES = (".mp4", ".m4v", ".mov", ".avi", ".mkv", ".webm", ".mpg", ".mpeg", ".ts", ".mts", ".wmv", ".flv", ".ogv")
_SIGNATURES = re.compile(  # MP4 and MOV, AVI, Matroska and WebM, MPEG, WMV, FLV, Ogg
    rb"....(?:ftyp(?!avi[fs]|he[iv][cx]|mif1)|moov|wide|mdat)|RIFF....AVI |\x1aE\xdf\xa3|\0\0\x01[\xba\xb3]|0&\xb2\x75|"
    rb"FLV\x01|OggS",
    re.DOTALL,
)
_TRUNCATED = re.compile(r"prematurely|partial file", re.IGNORECASE)  # FFmpeg's messages for a truncated container
_MP4_BOXES = (b"ftyp", b"moov", b"moof", b"mdat", b"wide", b"free", b"skip", b"sidx", b"uuid")  # top level of an MP4 or MOV
# A decoder conceals the missing part of a truncated frame with a message, up to this many frames before it returns that frame.
# Messages at earlier frames mean nothing: the files of some cameras cause one at every frame.
_DECODER_DELAY_FRAMES = 4
_AZURE_KINECT_HEAD_BYTES = 1 << 18  # header, calibration of some kilobytes and tags of a recording
_AZURE_KINECT_DEPTH = (
    "is a recording of Azure Kinect, whose depth is not read from the MKV: export it with Open3D's example "
    "azure_kinect_mkv_reader.py --input FILE --output FOLDER (AzureKinectMKVReader, where your Open3D has it) and give the folder"
)
_MAX_FPS = 1000.0  # a higher value is a time base, not a frame rate


class VideoCapture:
    """A video file for the 2-D mode, opened as a capture: frames named by number from 000000.

    The time of frame i is i / (frames per second), None if the frame rate is unknown. All frames are decoded once to count them,
    since the number in the file's header is often wrong. If the video is cut off, one frame is added at its end, which raises
    InputError when it is loaded.

    Raises
    ------
    InputError : the file is empty or no video, or has no complete frame.
    """

    what: ClassVar[str] = "a video file (MP4, MOV, AVI, MKV, ...)"
    format = "video"
    options: ClassVar[frozenset[str]] = frozenset()

    def __init__(self, path: Path, options: ReadOptions = DEFAULT) -> None:
        self.path = path
        self.no_depth = _AZURE_KINECT_DEPTH if _is_azure_kinect(path) else ""
        content, stat = _probe(path), path.stat()
        load = partial(_load, path, (stat.st_mtime_ns, stat.st_size), content)
        count = content.frames + content.truncated
        self.frames = [FrameRef(f"{i:06d}", path, partial(load, i), content.time(i)) for i in range(count)]

    @staticmethod
    def can_read(path: Path) -> bool:
        """Return whether `path` is a file with the first bytes or the suffix of a video format."""
        return path.is_file() and (_SIGNATURES.match(read_head(path, 32)) is not None or path.suffix.lower() in SUFFIXES)


def _is_azure_kinect(path: Path) -> bool:
    """Return whether a file is a Matroska recording of Azure Kinect, which has tags that start with K4A_."""
    head = read_head(path, _AZURE_KINECT_HEAD_BYTES)
    return head.startswith(b"\x1aE\xdf\xa3") and b"K4A_" in head


@dataclass(frozen=True)
class _VideoContent:
    """The content of a video.

    frames : number of complete frames. fps : frames per second, None if unknown. truncated : whether the file ends within a
    frame.
    """

    frames: int
    fps: float | None
    truncated: bool

    def time(self, index: int) -> float | None:
        """Return the time of frame number `index` (from 0), s after the first frame; None if the frame rate is unknown."""
        return index / self.fps if self.fps else None


def _open(path: Path) -> cv2.VideoCapture:
    # one thread, so that the decoder's messages appear while the frame in question is read
    return cv2.VideoCapture(str(path), cv2.CAP_FFMPEG, [cv2.CAP_PROP_N_THREADS, 1])


def _probe(path: Path) -> _VideoContent:
    """Count the frames by decoding them.

    Raises
    ------
    InputError : the file is empty, no video, or holds no complete frame.
    """
    if not path.stat().st_size:
        raise InputError(f"{path}: is empty", code="file-empty")
    with capture_native_output() as native:
        video = _open(path)
    if not video.isOpened():
        raise _not_opened(path, native.text)
    check_pixels(int(video.get(cv2.CAP_PROP_FRAME_WIDTH)), int(video.get(cv2.CAP_PROP_FRAME_HEIGHT)), str(path))
    rate = video.get(cv2.CAP_PROP_FPS)
    messages, container_ended = _decode_all(video)
    frames = len(messages) - 1
    concealed = any(messages[-_DECODER_DELAY_FRAMES - 1 : -1]) and not any(
        messages[-2 * _DECODER_DELAY_FRAMES - 1 : -_DECODER_DELAY_FRAMES - 1]
    )
    truncated = concealed or container_ended or bool(messages[-1]) or _overruns(path)
    frames -= concealed
    if not frames:
        end, code = (", it is cut off", "file-damaged") if truncated else ("", "video-empty")
        raise InputError(f"{path}: holds no complete frame{end}", code=code)
    return _VideoContent(frames, rate if 0 < rate <= _MAX_FPS else None, truncated)


def _decode_all(video: cv2.VideoCapture) -> tuple[list[str], bool]:
    """Return the decoder's messages at each frame and at the end, and whether the container ended early."""
    messages: list[str] = []
    more = True
    while more:
        with capture_native_output() as native:
            more = video.grab()
        messages.append(native.text)
    video.release()
    broken = [_TRUNCATED.search(text) is not None for text in messages]
    return ["" if is_broken else text for text, is_broken in zip(messages, broken, strict=True)], any(broken)


def _not_opened(path: Path, message: str) -> InputError:
    """Return the error for a file that FFmpeg cannot open, from its message."""
    if "moov atom not found" in message:
        sentence = "is cut off: the index that an MP4 or MOV has at its end is missing, without it no frame can be read"
        return InputError(f"{path}: {sentence}", code="file-damaged")
    first = message.partition("\n")[0]
    return InputError(f"{path}: cannot be read as a video" + (f" ({first})" if first else ""), code="video-unreadable")


def _overruns(path: Path) -> bool:
    """Return whether the last top-level part of an AVI, MP4 or MOV exceeds the end of the file; False for other formats."""
    size, at = path.stat().st_size, 0
    with path.open("rb") as file:
        while at < size:
            file.seek(at)
            length = _part_bytes(file.read(16))
            if length is None:
                return False
            at += length
    return at > size


def _part_bytes(head: bytes) -> int | None:
    """Return the length of a top-level part of an AVI, MP4 or MOV by its first 16 bytes; None if unknown or open-ended."""
    if head[:4] == b"RIFF":
        return 8 + int.from_bytes(head[4:8], "little")
    if head[4:8] not in _MP4_BOXES:
        return None
    length = int.from_bytes(head[:4], "big")
    length = int.from_bytes(head[8:16], "big") if length == 1 else length
    return length if length >= 8 else None


class _Reader:
    """A video that stays open, so that the next frame is read without decoding those before it again."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._video: cv2.VideoCapture | None = None
        self._next = 0
        self._lock = Lock()

    def read(self, index: int, last: bool) -> Array | None:
        """Return frame number `index` (from 0) as (H, W, 3) uint8 BGR; None if it cannot be decoded.

        `last` tells that this is the last frame of the video; the file is then closed.
        """
        with self._lock, capture_native_output():
            if self._video is None or index < self._next:
                self.close()
                self._video = _open(self._path)
            while self._next < index and self._video.grab():
                self._next += 1
            decoded, image = self._video.read()
            self._next += 1
            if last or not decoded:
                self.close()
        return np.asarray(image) if decoded else None

    def close(self) -> None:
        """Close the file."""
        if self._video is not None:
            self._video.release()
        self._video, self._next = None, 0


@lru_cache(maxsize=1)
def _reader(path: Path, stamp: tuple[int, int]) -> _Reader:
    """Return the reader that all frames of a video share, also unpickled ones; `stamp` identifies the file's version."""
    return _Reader(path)


def _load(path: Path, stamp: tuple[int, int], content: _VideoContent, index: int) -> FrameData:
    if index == content.frames:
        sentence = f"{path}: is cut off in the middle of this frame; the {index} frames before it are complete"
        raise InputError(sentence, code="file-damaged")
    image = _reader(path, stamp).read(index, index == content.frames - 1)
    if image is None:
        sentence = f"{path}: frame {index} cannot be decoded: has the file changed since it was opened?"
        raise InputError(sentence, code="video-unreadable")
    return FrameData(Image(cv2.cvtColor(image, cv2.COLOR_BGR2RGB), f"{index:06d}", content.time(index)))

"""A video file for the 2-D mode, through OpenCV and FFmpeg, read as it is asked for."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache, partial
from pathlib import Path
from threading import Lock
from typing import ClassVar

import cv2
import numpy as np

from ...errors import InputError
from ...types import Array, Image
from ..capture import FrameData, FrameRef
from ..read_options import DEFAULT, ReadOptions
from ..support.native_output import capture_native_output

SUFFIXES = (".mp4", ".m4v", ".mov", ".avi", ".mkv", ".webm", ".mpg", ".mpeg", ".ts", ".mts", ".wmv", ".flv", ".ogv")
_STARTS = re.compile(  # MP4 and MOV, AVI, Matroska and WebM, MPEG, WMV, FLV, Ogg
    rb"....(?:ftyp(?!avi[fs]|he[iv][cx]|mif1)|moov|wide|mdat)|RIFF....AVI |\x1aE\xdf\xa3|\0\0\x01[\xba\xb3]|0&\xb2\x75|"
    rb"FLV\x01|OggS",
    re.DOTALL,
)
_ENDED = re.compile(r"prematurely|partial file", re.IGNORECASE)  # what FFmpeg says of a container that is cut off
_BOXES = (b"ftyp", b"moov", b"moof", b"mdat", b"wide", b"free", b"skip", b"sidx", b"uuid")  # the parts of an MP4 or MOV
# A decoder patches up half a frame and complains, up to so many frames before it gives that frame out. That it complained
# before that as well means nothing: the files of some cameras give it reason to at every frame.
_DELAY = 4
_MAX_FPS = 1000.0  # more is a time base and no rate


class VideoCapture:
    """The frames of a video, named by their number from 000000, with the time that the frame rate gives.

    All frames are decoded once to be counted, since what the file's head says of their number is often wrong. A video
    that is cut off ends with a frame that fails and says so.
    """

    what: ClassVar[str] = "a video file (MP4, MOV, AVI, MKV, ...)"
    format = "video"

    def __init__(self, path: Path, options: ReadOptions = DEFAULT) -> None:
        self.path = path
        found, stat = _probe(path), path.stat()
        stamp = (stat.st_mtime_ns, stat.st_size)
        self.frames = [
            FrameRef(f"{i:06d}", path, partial(_load, path, stamp, i, found), found.time(i)) for i in range(found.frames)
        ]
        if found.cut:
            last = FrameRef(f"{found.frames:06d}", path, partial(_cut_off, path, found.frames), found.time(found.frames))
            self.frames.append(last)

    @staticmethod
    def can_read(path: Path) -> bool:
        """Whether `path` is a file that starts as videos do, or failing that is called so."""
        if not path.is_file():
            return False
        with path.open("rb") as file:
            return _STARTS.match(file.read(32)) is not None or path.suffix.lower() in SUFFIXES


@dataclass(frozen=True)
class _Found:
    """frames : that are whole. fps : per second; None where it is not known. cut : the file ends within a frame."""

    frames: int
    fps: float | None
    cut: bool

    def time(self, index: int) -> float | None:
        return index / self.fps if self.fps else None


def _open(path: Path) -> cv2.VideoCapture:
    # in one thread: what the decoder complains of is then said while the frame in question is read
    return cv2.VideoCapture(str(path), cv2.CAP_FFMPEG, [cv2.CAP_PROP_N_THREADS, 1])


def _probe(path: Path) -> _Found:
    """Count the frames by decoding them.

    Raises
    ------
    InputError : the file is empty, no video, or holds no whole frame.
    """
    if not path.stat().st_size:
        raise InputError(f"{path}: is empty", code="file-empty")
    with capture_native_output() as said:
        video = _open(path)
    if not video.isOpened():
        raise _unopened(path, said.text)
    rate = video.get(cv2.CAP_PROP_FPS)
    complaints, ended = _decode_all(video)
    frames = len(complaints) - 1
    patched = any(complaints[-_DELAY - 1 : -1]) and not any(complaints[-2 * _DELAY - 1 : -_DELAY - 1])
    cut = patched or ended or bool(complaints[-1]) or _overruns(path)
    frames -= patched
    if not frames:
        raise InputError(
            f"{path}: holds no whole frame" + (", it is cut off" if cut else ""), code="file-damaged" if cut else "video-empty"
        )
    return _Found(frames, rate if 0 < rate <= _MAX_FPS else None, cut)


def _decode_all(video: cv2.VideoCapture) -> tuple[list[str], bool]:
    """What the decoder complained of at each frame and at the end, and whether the container broke off."""
    complaints: list[str] = []
    ended, more = False, True
    while more:
        with capture_native_output() as said:
            more = video.grab()
        broken = _ENDED.search(said.text) is not None
        complaints.append("" if broken else said.text)
        ended = ended or broken
    video.release()
    return complaints, ended


def _unopened(path: Path, said: str) -> InputError:
    if "moov atom not found" in said:
        return InputError(
            f"{path}: is cut off: the index that an MP4 or MOV has at its end is missing, without it no frame can be read",
            code="file-damaged",
        )
    first = said.partition("\n")[0]
    return InputError(f"{path}: cannot be read as a video" + (f" ({first})" if first else ""), code="video-unreadable")


def _overruns(path: Path) -> bool:
    """Whether the last part of an AVI, MP4 or MOV is said to be longer than the file goes on; of others it is not known."""
    size, at = path.stat().st_size, 0
    with path.open("rb") as file:
        while at < size:
            file.seek(at)
            length = _part(file.read(16))
            if length is None:
                return False
            at += length
    return at > size


def _part(head: bytes) -> int | None:
    """The bytes that a part of an AVI, MP4 or MOV has by its first 16; None where it is none, or as long as the file."""
    if head[:4] == b"RIFF":
        return 8 + int.from_bytes(head[4:8], "little")
    if head[4:8] not in _BOXES:
        return None
    length = int.from_bytes(head[:4], "big")
    length = int.from_bytes(head[8:16], "big") if length == 1 else length
    return length if length >= 8 else None


class _Reader:
    """A video that stays open, so that the next frame costs no decoding of those before it."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._video: cv2.VideoCapture | None = None
        self._next = 0
        self._lock = Lock()

    def read(self, index: int, last: bool) -> Array | None:
        """(H, W, 3) uint8 BGR of the frame; None where it cannot be decoded. After the `last` the file is closed."""
        with self._lock, capture_native_output():
            if self._video is None or index < self._next:
                self.close()
                self._video = _open(self._path)
            while self._next < index and self._video.grab():
                self._next += 1
            good, image = self._video.read()
            self._next += 1
            if last or not good:
                self.close()
        return np.asarray(image) if good else None

    def close(self) -> None:
        """Let go of the file."""
        if self._video is not None:
            self._video.release()
        self._video, self._next = None, 0


@lru_cache(maxsize=1)
def _reader(path: Path, stamp: tuple[int, int]) -> _Reader:
    """One reader for all entries of a video, also where they come from another process; `stamp` tells a changed file."""
    return _Reader(path)


def _load(path: Path, stamp: tuple[int, int], index: int, found: _Found) -> FrameData:
    image = _reader(path, stamp).read(index, index == found.frames - 1)
    if image is None:
        raise InputError(f"{path}: frame {index} cannot be decoded: has the file changed meanwhile?", code="video-unreadable")
    return FrameData(Image(cv2.cvtColor(image, cv2.COLOR_BGR2RGB), f"{index:06d}", found.time(index)))


def _cut_off(path: Path, frames: int) -> FrameData:
    raise InputError(
        f"{path}: ends in the middle of this frame, it is cut off; the {frames} frames before are whole", code="file-damaged"
    )

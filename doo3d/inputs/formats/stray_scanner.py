"""Define the layout of recordings of the app Stray Scanner: github.com/strayrobots/scanner, docs/format.md."""

from pathlib import Path

import cv2

from ...types import Floats
from ..read_options import ReadOptions, without_color
from ..support.camera_search import scaled
from ..support.depth_frames import numbers, pinhole_of
from ..support.images import Size
from ..support.known_cameras import STRAY_VIDEO_SIZE, KnownCamera
from ..support.listing import depth_images
from .image_folder import Files, Layout
from .trajectory import pose_from, read_lines
from .video import VideoCapture

_MATRIX, _ODOMETRY, _VIDEO = "camera_matrix.csv", "odometry.csv", "rgb.mp4"
_ODOMETRY_ROW = "timestamp, frame, x, y, z, qx, qy, qz, qw"


def _list_stray(path: Path, options: ReadOptions, notes: list[str]) -> list[Files]:
    depth, rows = depth_images(path), dict[int, tuple[float, Floats]]()
    if (path / _ODOMETRY).is_file():
        for line, words in read_lines(path / _ODOMETRY, 9, _ODOMETRY_ROW):
            if words[0] != "timestamp":
                where = f"{path / _ODOMETRY}: line {line}"
                values = numbers([*map(str.strip, words[:9])], 9, f"{where}, {_ODOMETRY_ROW}", "line-invalid").tolist()
                rows[int(values[1])] = (values[0], pose_from(values[5:9], values[2:5], where))
    video = VideoCapture(path / _VIDEO).frames if (path / _VIDEO).is_file() and not without_color(options) else None
    if video is None and not without_color(options):
        notes.append(f"there is no {_VIDEO}, so depth is read alone")
    frames = []
    for index, (name, file) in enumerate(depth.items()):
        number = int(name) if name.isdecimal() else index
        time, pose = rows.get(number, (None, None))
        files = Files(name, file, time=time, pose=pose)
        if video is not None:
            color = video[number] if number < len(video) else None
            files = files.with_color(color, f"{path / _VIDEO}: has no frame for {file}")
        frames.append(files)
    return frames


def _stray_camera(path: Path, listed: list[Files], size: Size | None) -> KnownCamera:
    """Return the camera of Stray Scanner's depth images, scaled from the video's camera in the file."""
    words = [word for _, row in read_lines(path / _MATRIX, 3, "a camera matrix, three numbers a line") for word in row]
    video = cv2.VideoCapture(str(path / _VIDEO)) if (path / _VIDEO).is_file() else None
    given = [int(video.get(side)) for side in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT)] if video else [0]
    width, height = given if min(given) > 0 else STRAY_VIDEO_SIZE
    x, y = (size[0] / width, size[1] / height) if size else (1.0, 1.0)
    return KnownCamera(scaled(pinhole_of(words, str(path / _MATRIX)), x, y))


STRAY = Layout(
    "stray",
    f"a recording of the app Stray Scanner (depth/, {_VIDEO}, {_MATRIX}, {_ODOMETRY})",
    can_read=lambda path: (path / "depth").is_dir() and (path / _MATRIX).is_file(),
    frames=_list_stray,
    camera=_stray_camera,
)

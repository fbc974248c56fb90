"""A sequence of the TUM RGB-D benchmark, and recordings in its layout.

Sturm, Engelhard, Endres, Burgard, Cremers, *A Benchmark for the Evaluation of RGB-D SLAM Systems* (IROS 2012);
cvg.cit.tum.de/data/datasets/rgbd-dataset/file_formats.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import ClassVar

import numpy as np

from ...errors import InputError
from ...types import Floats, Ints
from ..capture import FrameRef
from ..read_options import DEFAULT, OF_DEPTH, ReadOptions, without_color
from ..support.camera_search import find_camera
from ..support.depth_frames import DepthSensor, ImageFiles, load_files
from ..support.images import image_size
from .trajectory import Trajectory, read_lines, read_trajectory, sort_by_time

SCALE = 5000.0  # units per metre
PINHOLE, SIZE = (525.0, 525.0, 319.5, 239.5), (640, 480)  # the benchmark's default, px
CALIBRATIONS = {  # px, of the color cameras, whose pixels the depth images have (file_formats, "Calibration of the color camera")
    "freiburg1": (517.3, 516.5, 318.6, 255.3),
    "freiburg2": (520.9, 521.0, 325.1, 249.7),
    "freiburg3": (535.4, 539.2, 320.1, 247.6),
}
DEPTH, COLOR, TRUTH = "depth.txt", "rgb.txt", "groundtruth.txt"


class TumCapture:
    """A sequence of the TUM RGB-D benchmark, opened as a capture: depth images with colour, in order of time.

    `depth.txt` and `rgb.txt` list the images with their times. They are paired by time within the option `tolerance`, each
    image at most once, nearest pairs first; images without a partner are left out, as by the benchmark's associate.py. Without
    `rgb.txt` each depth image is a frame. A frame has the name and the time of its depth image, and the pose of
    `groundtruth.txt` at that time. Lists that are not in order of time are sorted. The camera is that of a camera file beside
    the lists, else that of freiburg1, 2 or 3 if the path has this word, else the benchmark's default, fx = fy = 525, cx =
    319.5, cy = 239.5 px for 640x480; the unit is 5000 per metre unless the file has another.
    """

    what: ClassVar[str] = f"a sequence of the TUM RGB-D benchmark ({DEPTH}, {COLOR}, {TRUTH})"
    format = "tum"
    options: ClassVar[frozenset[str]] = OF_DEPTH | {"tolerance"}

    def __init__(self, path: Path, options: ReadOptions = DEFAULT) -> None:
        self.path = path
        times, depth, self.notes = _listed(path / DEPTH)
        color: list[Path | None] = [None] * len(depth)
        if (path / COLOR).is_file() and not without_color(options):
            others, images, notes = _listed(path / COLOR)
            self.notes += notes
            one, other = associate(times, others, options.tolerance)
            if not len(one):
                raise InputError(
                    f"{path}: the times of {DEPTH} are {times[0]} to {times[-1]} s, of {COLOR} {others[0]} to {others[-1]} s: no "
                    f"two images are within {options.tolerance} s of each other (--input-option tolerance=...)",
                    code="times-apart",
                )
            times, depth, color = times[one], [depth[i] for i in one], [images[i] for i in other]
        truth = read_trajectory(path / TRUTH) if (path / TRUTH).is_file() else None
        self.notes += truth.notes if truth else ()
        sensor, notes = _sensor(path, depth[0], options)
        self.notes += notes
        self.frames = [
            _frame(ImageFiles(*files), sensor, time, truth, options.tolerance)
            for files, time in zip(zip(depth, color, strict=True), times.tolist(), strict=True)
        ]

    @staticmethod
    def can_read(path: Path) -> bool:
        """Return whether `path` is a folder with `depth.txt`, or with `rgb.txt` and a sub-folder `depth/`."""
        return path.is_dir() and ((path / DEPTH).is_file() or ((path / COLOR).is_file() and (path / "depth").is_dir()))


def associate(one: Floats, other: Floats, tolerance: float) -> tuple[Ints, Ints]:
    """Pair the times of two lists that are nearest to each other, each time in one pair at most.

    Of all pairs within the tolerance, that with the least difference is taken first, as by the benchmark's associate.py.

    Parameters
    ----------
    one, other
        times in s, increasing: (N,) and (M,).
    tolerance
        largest time difference within a pair, s.

    Returns
    -------
    Two (P,) int arrays: for each of the P pairs its index into `one` and its index into `other`. The indices into `one` increase.
    """
    low, high = np.searchsorted(other, one - tolerance), np.searchsorted(other, one + tolerance, side="right")
    i = np.repeat(np.arange(len(one)), high - low)
    j = np.concatenate([np.arange(a, b) for a, b in zip(low, high, strict=True)]) if len(i) else np.zeros(0, int)
    pairs: dict[int, int] = {}
    used: set[int] = set()
    for k in np.lexsort((j, i, np.abs(one[i] - other[j]))):
        if i[k] not in pairs and j[k] not in used:
            pairs[int(i[k])] = int(j[k])
            used.add(int(j[k]))
    first = np.array(sorted(pairs), dtype=int)
    return first, np.array([pairs[a] for a in first.tolist()], dtype=int)


def _listed(path: Path) -> tuple[Floats, list[Path], list[str]]:
    """Return the times (N,) s, increasing, and the files of a list, with notes."""
    times, rows, notes = sort_by_time(path, read_lines(path, 2, "time and file name"))
    return times, [path.parent / " ".join(words[1:]) for _, words in rows], notes


def _sensor(path: Path, depth: Path, options: ReadOptions) -> tuple[DepthSensor, list[str]]:
    """Return the camera and the unit of the depth images, with notes that name where they come from."""
    if options.camera is not None:
        return DepthSensor(options.camera, options.depth_scale or SCALE, array_scale=options.depth_scale), []
    given = options.depth_scale
    if found := find_camera(path, image_size(depth), aligned=True):
        camera = found.camera
        return DepthSensor(camera.pinhole, given or camera.scale or SCALE, camera.size, given), found.notes
    words = path.resolve().as_posix().lower()
    name = next((name for name in CALIBRATIONS if name in words), None)
    if name is not None:
        return DepthSensor(CALIBRATIONS[name], given or SCALE, SIZE, given), [
            f"the camera is the benchmark's calibration of {name}"
        ]
    unit = "" if given else f", and the unit {SCALE:g} per metre"
    note = f"the camera is the benchmark's default, fx = fy = 525 px{unit}: give --camera FILE if the recording is of your own"
    return DepthSensor(PINHOLE, given or SCALE, SIZE, given), [note]


def _frame(files: ImageFiles, sensor: DepthSensor, time: float, truth: Trajectory | None, tolerance: float) -> FrameRef:
    pose = truth.at(time, tolerance) if truth else None
    name = files.depth.stem
    return FrameRef(name, files.depth, partial(load_files, files, sensor, name, time, pose), time)

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
from ..read_options import DEFAULT, ReadOptions
from ..support.depth_frames import DepthSensor, ImageFiles, load_files
from .trajectory import Trajectory, increasing_times, read_lines, read_trajectory

SCALE = 5000.0  # units per metre
PINHOLE, SIZE = (525.0, 525.0, 319.5, 239.5), (640, 480)  # the benchmark's default, px
DEPTH, COLOR, TRUTH = "depth.txt", "rgb.txt", "groundtruth.txt"


class TumCapture:
    """A sequence of the TUM RGB-D benchmark, opened as a capture: depth images with colour, in order of time.

    `depth.txt` and `rgb.txt` list the images with their times. They are paired by time within the option `tolerance`, each image
    at most once, nearest pairs first; images without a partner are left out, as by the benchmark's associate.py. Without
    `rgb.txt` each depth image is a frame. A frame has the name and the time of its depth image, and the pose of `groundtruth.txt`
    at that time. Defaults are fx = fy = 525, cx = 319.5, cy = 239.5 px for 640x480, and 5000 units per metre.
    """

    what: ClassVar[str] = f"a sequence of the TUM RGB-D benchmark ({DEPTH}, {COLOR}, {TRUTH})"
    format = "tum"

    def __init__(self, path: Path, options: ReadOptions = DEFAULT) -> None:
        self.path = path
        times, depth = _listed(path / DEPTH)
        color: list[Path | None] = [None] * len(depth)
        if (path / COLOR).is_file():
            others, images = _listed(path / COLOR)
            one, other = associate(times, others, options.tolerance)
            if not len(one):
                raise InputError(
                    f"{path}: the times of {DEPTH} are {times[0]} to {times[-1]} s, of {COLOR} {others[0]} to {others[-1]} s: no "
                    f"two images are within {options.tolerance} s of each other (--input-option tolerance=...)",
                    code="times-apart",
                )
            times, depth, color = times[one], [depth[i] for i in one], [images[i] for i in other]
        truth = read_trajectory(path / TRUTH) if (path / TRUTH).is_file() else None
        sensor = DepthSensor(options.camera or PINHOLE, options.depth_scale or SCALE, None if options.camera else SIZE)
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


def _listed(path: Path) -> tuple[Floats, list[Path]]:
    """Return the times (N,) s and the files of a list."""
    rows = read_lines(path, 2, "time and file name")
    return increasing_times(path, rows), [path.parent / " ".join(words[1:]) for _, words in rows]


def _frame(files: ImageFiles, sensor: DepthSensor, time: float, truth: Trajectory | None, tolerance: float) -> FrameRef:
    pose = truth.at(time, tolerance) if truth else None
    name = files.depth.stem
    return FrameRef(name, files.depth, partial(load_files, files, sensor, name, time, pose), time)

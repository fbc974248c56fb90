"""Measure the time of each stage: the same frame repeatedly, in one process with one thread."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from ..config import Config
from ..inputs import FrameData, open_capture
from ..pipeline import detect
from ..types import Cloud, Frame
from ..types.display import counted

WARM_UP_RUNS = 3
"""Number of runs before the timed ones, which fill the caches."""

YARDSTICK_RUNS = 50
YARDSTICK_SIZE = (720, 1280)


@dataclass(frozen=True)
class Timing:
    """The measured times of detection in one frame.

    Attributes
    ----------
    name
        name of the frame.
    size
        "WIDTHxHEIGHT" in px, such as "1280x720", or "20000 points" for a cloud.
    chains
        number of chains detected.
    runs
        number of timed runs.
    stages
        name of the stage -> (median, 95th percentile) of its time over the runs, ms; the last, "total", is the whole detection.
    peak_mb
        peak memory of the process so far, MB (2^20 bytes); None if the system does not report it.
    yardstick
        time in ms of a fixed piece of image processing on this machine, from `measure_yardstick`; times divided by it can be
        compared between machines.
    """

    name: str
    size: str
    chains: int
    runs: int
    stages: dict[str, tuple[float, float]]
    peak_mb: float | None
    yardstick: float = float("nan")

    def lines(self) -> list[str]:
        """Return the lines that `doo3d bench` prints for this frame: heading, a line per stage, total, yardstick, peak memory.

        The columns of a stage are its median and 95th percentile in ms, and its median in multiples of the yardstick.
        """
        width = max(map(len, self.stages))
        rows = [
            f"{stage:<{width}}{median:>10.1f}{percentile:>10.1f}{median / self.yardstick:>12.1f}"
            for stage, (median, percentile) in self.stages.items()
        ]
        head = f"{self.name}: {self.size}, {counted(self.chains, 'chain')}, {self.runs} runs, one thread"
        columns = f"{'ms':<{width}}{'median':>10}{'95 %':>10}{'yardsticks':>12}"
        return [head, columns, *rows[:-1], "-" * len(columns), rows[-1], *footer([self])]


def table(timings: Sequence[Timing]) -> list[str]:
    """Return the lines of a table of whole detections, one per frame: median and 95th percentile in ms, median in yardsticks."""
    width = max(len(timing.name) for timing in timings)
    head = f"{'ms':<{width}}{'chains':>8}{'median':>10}{'95 %':>10}{'yardsticks':>12}"
    rows = []
    for timing in timings:
        median, percentile = timing.stages["total"]
        times = f"{median:>10.1f}{percentile:>10.1f}{median / timing.yardstick:>12.1f}"
        rows.append(f"{timing.name:<{width}}{timing.chains:>8}{times}")
    return [head, *rows, "-" * len(head), f"{timings[0].runs} runs of each frame, one thread", *footer(timings)]


def footer(timings: Sequence[Timing]) -> list[str]:
    """Return the lines below a table: the yardstick (median over the frames) and, if known, the peak memory."""
    middle = sorted(timing.yardstick for timing in timings)[len(timings) // 2]
    peak = timings[-1].peak_mb
    yardstick = f"yardstick {middle:.2f} ms: 1280x720 to HSV, and a range test"
    return [yardstick, *([f"peak memory {peak:.0f} MB"] if peak is not None else [])]


def measure_yardstick(runs: int = YARDSTICK_RUNS) -> float:
    """Return the yardstick in ms: the time of converting a 1280x720 RGB image to HSV and testing a range, in one thread.

    This is about the time of one pass over a frame, so that times divided by it can be compared between machines.

    runs : number of measurements, of which the median is returned.
    """
    image = np.random.default_rng(0).integers(0, 256, (*YARDSTICK_SIZE, 3), dtype=np.uint8)
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    seconds = []
    for _ in range(runs):
        start = time.perf_counter()
        cv2.inRange(cv2.cvtColor(image, cv2.COLOR_RGB2HSV), (20, 50, 50), (120, 255, 255))
        seconds.append(time.perf_counter() - start)
    cv2.setNumThreads(threads)
    return float(np.median(seconds)) * 1000


def time_frame(name: str, frame: FrameData, config: Config, runs: int) -> Timing:
    """Time detection in one frame, after 3 runs that are not timed.

    Parameters
    ----------
    name
        name of the frame, for the table.
    frame
        data and mask of the frame.
    config
        configuration of the detection.
    runs
        number of timed runs, 1 or more.

    Returns
    -------
    Median and 95th percentile of each stage's time in ms, with the peak memory and the yardstick.

    Raises
    ------
    InputError : the frame cannot be used.
    """
    seconds: list[dict[str, float]] = []
    for _ in range(WARM_UP_RUNS + runs):
        start = time.perf_counter()
        detection = detect(frame.data, config, frame.mask_for(config))
        seconds.append(detection.seconds | {"total": time.perf_counter() - start})
    stages = {}
    for stage in seconds[-1]:
        milliseconds = np.array([run[stage] for run in seconds[WARM_UP_RUNS:]]) * 1000
        stages[stage] = (float(np.median(milliseconds)), float(np.percentile(milliseconds, 95)))
    if isinstance(frame.data, Cloud):
        size = f"{len(frame.data.points)} points"
    else:
        shape = frame.data.depth.shape if isinstance(frame.data, Frame) else frame.data.color.shape
        size = f"{shape[1]}x{shape[0]}"
    return Timing(name, size, len(detection.chains), runs, stages, peak_memory_mb(), measure_yardstick())


def bench(paths: Sequence[Path], config: Config, runs: int) -> list[Timing]:
    """Time detection in the first frame of each capture.

    Parameters
    ----------
    paths
        paths of the captures.
    config
        configuration of the detection.
    runs
        number of timed runs of each frame.

    Returns
    -------
    A Timing per frame, in the order of `paths`.

    Raises
    ------
    InputError : a capture cannot be read, or its frame cannot be used.
    """
    frames = [(str(path), open_capture(path, config.mode == "2d").frames[0].load()) for path in paths]
    return [time_frame(name, frame, config, runs) for name, frame in frames]


def peak_memory_mb() -> float | None:
    """Return the peak memory of this process so far, MB (2^20 bytes); None if the system does not report it."""
    status = Path("/proc/self/status")
    if status.exists():
        for line in status.read_text().splitlines():
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) / 1024
    try:
        import resource
    except ImportError:
        return None
    import sys

    # bytes on macOS, kilobytes elsewhere
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1 << 20 if sys.platform == "darwin" else 1 << 10)

"""How long the stages take: one process, one thread, the same frame again and again."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..config import Config
    from ..inputs import FrameData

WARM_UP = 3  # runs that are not counted: compiling, caches
DEFAULT_SCENE = ("crossing", 0)


@dataclass(frozen=True)
class Timing:
    """What one frame took.

    size : such as "1280x720" or "20000 points". chains : found. runs : counted.
    stages : stage -> (median, 95th percentile) ms, in order; "total" is the whole of `detect`. peak : MB of memory, of the
    whole process so far; None where the system does not tell.
    """

    name: str
    size: str
    chains: int
    runs: int
    stages: dict[str, tuple[float, float]]
    peak: float | None

    def lines(self) -> list[str]:
        """A table for people."""
        table = [f"{stage:<12}{median:>10.1f}{late:>10.1f}" for stage, (median, late) in self.stages.items()]
        head = f"{self.name}: {self.size}, {self.chains} chain{'' if self.chains == 1 else 's'}, {self.runs} runs, one thread"
        memory = [f"peak memory {self.peak:.0f} MB"] if self.peak is not None else []
        return [head, f"{'ms':<12}{'median':>10}{'95 %':>10}", *table[:-1], "-" * 32, table[-1], *memory]


def measure(name: str, shot: FrameData, config: Config, runs: int) -> Timing:
    """Detect in one shot `runs` times after the warm-up.

    Raises
    ------
    InputError : nothing can be detected in it.
    """
    import numpy as np

    from ..pipeline import detect
    from ..types import Cloud, Frame

    seconds: list[dict[str, float]] = []
    for _ in range(WARM_UP + runs):
        start = time.perf_counter()
        detection = detect(shot.data, config, shot.mask_for(config))
        seconds.append(detection.seconds | {"total": time.perf_counter() - start})
    stages = {}
    for stage in seconds[-1]:
        taken = np.array([run[stage] for run in seconds[WARM_UP:]]) * 1000
        stages[stage] = (float(np.median(taken)), float(np.percentile(taken, 95)))
    if isinstance(shot.data, Cloud):
        size = f"{len(shot.data.points)} points"
    else:
        shape = shot.data.depth.shape if isinstance(shot.data, Frame) else shot.data.color.shape
        size = f"{shape[1]}x{shape[0]}"
    return Timing(name, size, len(detection.chains), runs, stages, peak_memory())


def bench(paths: Sequence[Path], config: Config, runs: int) -> list[Timing]:
    """Time the first frame of each capture, or without any, of a rendered 1280x720 frame.

    Raises
    ------
    InputError : one of them cannot be read, or nothing can be detected in it.
    """
    from ..inputs import open_capture

    if not paths:
        return [measure("rendered " + DEFAULT_SCENE[0], _rendered(), config, runs)]
    shots = [(str(path), open_capture(path, config.mode == "2d").frames[0].load()) for path in paths]
    return [measure(name, shot, config, runs) for name, shot in shots]


def _rendered() -> FrameData:
    """The default scene's frame, rendered by a process of its own so that this one's memory is the detector's alone."""
    import numpy as np

    from ..inputs import FrameData
    from ..types import Camera, Frame

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "frame.npz"
        process = get_context("spawn").Process(target=_render, args=(path,))
        process.start()
        process.join()
        if process.exitcode:
            raise RuntimeError(f"rendering the frame ended with exit code {process.exitcode}")
        with path.open("rb") as file, np.load(file) as arrays:
            fx, fy, cx, cy = arrays["camera"].tolist()
            height, width = arrays["depth"].shape
            return FrameData(Frame(arrays["color"], arrays["depth"], Camera(fx, fy, cx, cy, width, height)))


def _render(path: Path) -> None:
    import numpy as np

    from ..evaluation.rendering.renderer import render
    from ..evaluation.scenes.registry import make_scene

    frame = render(make_scene(*DEFAULT_SCENE)).frame
    camera = frame.camera
    np.savez(path, color=np.asarray(frame.color), depth=frame.depth, camera=[camera.fx, camera.fy, camera.cx, camera.cy])


def peak_memory() -> float | None:
    """The most memory that this process ever had, MB; None where the system does not tell."""
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

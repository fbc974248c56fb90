"""Define the frames that `doo3d bench` times without an input: rendered or drawn, in a separate process."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import cache, partial
from multiprocessing import get_context
from typing import TYPE_CHECKING

import numpy as np

from ..config import Config, load_config
from ..inputs import FrameData
from ..types import Cloud
from .benchmark import Timing, time_frame

if TYPE_CHECKING:
    from ..evaluation.rendering.renderer import Rendered

JITTER = 3e-4
"""Standard deviation in m by which repeated points are displaced, if a cloud has fewer points than wanted."""


@dataclass(frozen=True)
class BenchCase:
    """A frame to be timed.

    Attributes
    ----------
    name
        name of the case, for the table.
    make
        function that renders or draws the frame and returns it; picklable.
    preset
        the preset of the detection of an image; None for frames and clouds, whose configuration the user chooses.
    """

    name: str
    make: Callable[[], FrameData]
    preset: str | None = None


@cache
def _rendered(family: str, sensor: str) -> Rendered:
    from ..evaluation.rendering.renderer import render
    from ..evaluation.scenes.registry import make_scene

    return render(make_scene(family, 0), sensor)


def scene(family: str, with_mask: bool) -> FrameData:
    """Render a scene of a family as a D435 frame, 1280x720 px, with the true mask or without a mask."""
    rendered = _rendered(family, "d435")
    return FrameData(rendered.frame, rendered.mask if with_mask else None)


def stereo_scene(family: str) -> FrameData:
    """Render a scene of a family as a stereo frame, 1280x720 px, with a mask that has the errors of a segmentation."""
    from ..evaluation.rendering.ragged_mask import ragged_mask
    from ..evaluation.scenes.registry import family_rng

    rendered = _rendered(family, "stereo")
    return FrameData(rendered.frame, ragged_mask(rendered.mask, family_rng(f"{family}_000/ragged", 0)))


def photo(cables: int, seed: int) -> FrameData:
    """Draw an image of cables on cloth, 640x480 px, with its mask."""
    from ..evaluation.photos.drawn import draw_photo

    return FrameData(*draw_photo(cables, seed))


def cloud(points: int) -> FrameData:
    """Return a cloud of `points` points: those of a cable that crosses itself, and displaced copies of them."""
    rendered = _rendered("crossing", "d435")
    depth = rendered.frame.depth
    v, u = np.nonzero(rendered.mask & (depth > 0))
    seen = rendered.frame.camera.unproject(np.column_stack((u, v)), depth[v, u].astype(float))
    rng = np.random.default_rng(0)
    copies = [seen + rng.normal(0, JITTER, seen.shape) for _ in range((points - 1) // len(seen))]
    chosen = rng.permutation(len(seen) * (1 + len(copies)))[:points]
    return FrameData(Cloud(np.concatenate([seen, *copies])[np.sort(chosen)]))


CASES = (
    BenchCase("crossing, mask given", partial(scene, "crossing", True)),
    BenchCase("crossing", partial(scene, "crossing", False)),
    BenchCase("tangle, mask given", partial(scene, "tangle", True)),
    BenchCase("several, mask given", partial(scene, "several", True)),
    BenchCase("stereo coil, ragged mask", partial(stereo_scene, "coil")),
    *(
        BenchCase(f"{name}, {preset}", partial(photo, *drawn), preset)
        for name, drawn in {
            "photograph, 1 cable": (1, 2),
            "photograph, 3 cables": (3, 4),
            "photograph, 5 cables": (5, 2),
            "photograph, side by side": (2, 6),
        }.items()
        for preset in ("image", "paper_2d")
    ),
    BenchCase("cloud, 9,000 points", partial(cloud, 9_000)),
)
"""The timed cases. With these seeds, the cables of the drawn images cross; in some images they also run side by side."""

LARGE_CASE = BenchCase("cloud, 1,000,000 points", partial(cloud, 1_000_000))
"""A case whose runs take a second or more each."""


def time_cases(
    config: Config,
    runs: int,
    cases: Sequence[BenchCase] = CASES,
    with_progress: Callable[[Sequence[BenchCase]], Iterable[BenchCase]] = iter,
) -> Iterator[Timing]:
    """Render and time one case after the other.

    A separate process renders, so that the peak memory of this one is that of the detection. It is idle while this one detects.

    Parameters
    ----------
    config
        configuration of frames and clouds; with a 2-D mode, only the images are timed, all with this configuration.
    runs
        number of timed runs of each frame.
    cases
        the cases.
    with_progress
        called with the timed cases; returns an iterable of the same cases, for example one that shows a progress bar.
    """
    if config.mode == "2d":
        images = {case.name.rpartition(", ")[0]: case.make for case in cases if case.preset}
        cases = [BenchCase(name, make) for name, make in images.items()]
    with ProcessPoolExecutor(1, get_context("spawn"), _start_renderer) as renderer:
        for case in with_progress(cases):
            frame = renderer.submit(case.make).result()
            yield time_frame(case.name, frame, load_config(case.preset) if case.preset else config, runs)


def _start_renderer() -> None:
    """Prepare the rendering process: use one thread, and ignore Ctrl-C, which the main process handles."""
    from ..runs.threads import single_thread

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    single_thread()

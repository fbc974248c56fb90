"""Define the kinds of data for ablations: each frame is loaded once, and the detection runs in it many times."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from ...config import load_config
from ...types import Bools, Camera, Chain, Cloud, Detection, Frame, Image
from ..metrics.score import score
from ..metrics.trees import score_trees
from ..rendering.ragged_mask import ragged_mask
from ..rendering.renderer import render
from ..scenes.model import Scene, Truth
from ..scenes.registry import TREES, family_rng, make_scene
from .cases import KnownFrame, known_frame
from .evaluate import Masking, detect_safely

BRANCHED = ("harnesses", "harness clouds")
"""Kinds of data with branched objects."""

CLOUD_POINTS = 9_000
"""Number of object points sampled from a frame to make a cloud."""


class Outcome(NamedTuple):
    """The result of one detection, compared with the truth.

    Attributes
    ----------
    right
        whether the frame is right by the strict rule.
    in_image
        whether it is right in the image; for branched objects, whether every detected junction is a true one.
    crossings, crossings_right
        number of true crossings whose upper strand is seen, and of those detected with the right strand on top.
    confidence
        confidence of the detection, 0 to 1.
    ms
        duration of the detection.
    """

    right: bool
    in_image: bool
    crossings: int
    crossings_right: int
    confidence: float
    ms: float


Run = Callable[[dict[str, object]], Outcome]
"""Function that runs the detection with changed settings: dotted key -> value, which override those of the trial."""


@dataclass(frozen=True)
class Trial:
    """One frame with known truth, given to the detection as one kind of data.

    Attributes
    ----------
    kind
        a key of KINDS.
    name
        name of the frame.
    load
        function that renders or reads the frame, and returns the function that runs the detection in it.
    """

    kind: str
    name: str
    load: Callable[[], Run]


def make_trials(kinds: Iterable[str], families: Sequence[str], seeds: Iterable[int], size: tuple[int, int]) -> Iterator[Trial]:
    """Yield a trial for every kind of data, family and seed; nothing is rendered yet.

    Parameters
    ----------
    kinds
        keys of KINDS.
    families
        families of scenes; the kinds in BRANCHED use all families of branched objects instead.
    seeds
        integers, 0 or more.
    size
        (width, height) px of the images.
    """
    seeds = list(seeds)
    for kind in kinds:
        for family in TREES if kind in BRANCHED else families:
            for seed in seeds:
                yield Trial(kind, f"{family.rpartition('/')[2]}_{seed:03d}", partial(KINDS[kind], family, seed, size))


def _run(
    data: Frame | Cloud | Image,
    mask: Bools | None,
    config: tuple[str, dict[str, object]],
    judge: Callable[[Detection], tuple[bool, bool, int, int]],
) -> Run:
    """Return the function that runs the detection in `data`.

    config : name of a preset, and settings that override it. judge : returns the first four values of the Outcome.
    """
    preset, own = config

    def run(settings: dict[str, object]) -> Outcome:
        detection, timing = detect_safely(data, load_config(preset, own | settings), mask)
        return Outcome(*judge(detection), detection.confidence or 0.0, timing["ms"])

    return run


def _judge(truths: Sequence[Truth], camera: Camera, detection: Detection) -> tuple[bool, bool, int, int]:
    """Return right, in_image, crossings and crossings_right of a detection, scored in space and in the image."""
    found = score(detection.chains, truths, detection.crossings, camera)
    return found.correct, bool(found.image_correct), found.crossings, found.crossings_correct


def _judge_image(truths: Sequence[Truth], camera: Camera, detection: Detection) -> tuple[bool, bool, int, int]:
    """Score 2-D chains, placed on a plane at the median depth of the cables; see `_judge`."""
    depth = float(np.median(np.concatenate([truth.axis[:, 2] for truth in truths])))
    found = score(tuple(_lifted(chain, camera, depth) for chain in detection.chains), truths, None, camera)
    return bool(found.image_correct), bool(found.image_correct), 0, 0


def _judge_trees(scene: Scene, detection: Detection) -> tuple[bool, bool, int, int]:
    """Score branched objects; see `_judge`."""
    found = score_trees(detection, scene)
    return found["correct"], found["taken"] == found["false"] == 0, found["crossings"], found["crossed"]


def _frame(sensor: str, method: Masking, known_count: bool, family: str, seed: int, size: tuple[int, int]) -> Run:
    """Return the detection in a rendered frame with a true mask, a ragged one or none, with or without the number of cables."""
    known, frame = _known(family, seed, size, sensor)
    mask = _ragged(known.mask, f"{family}_{seed}") if method == "ragged" else known.mask if method == "mask" else None
    chains = len(known.truths) if known_count else None
    return _run(frame, mask, ("default", {"merge.chains": chains}), partial(_judge, known.truths, frame.camera))


def _image(mask_given: bool, family: str, seed: int, size: tuple[int, int]) -> Run:
    """Return the detection in the color image of a rendered frame alone, with a ragged mask or none."""
    known, frame = _known(family, seed, size, "none")
    assert frame.color is not None
    mask = _ragged(known.mask, f"{family}_{seed}") if mask_given else None
    return _run(Image(frame.color), mask, ("image", {}), partial(_judge_image, known.truths, frame.camera))


def _cloud(sparse: bool, family: str, seed: int, size: tuple[int, int]) -> Run:
    """Return the detection in the object points of a frame; `sparse` keeps only every 12th row of pixels."""
    known, frame = _known(family, seed, size, "d435")
    assert known.mask is not None
    rows = np.arange(frame.depth.shape[0])[:, None] % 12 == 0 if sparse else True
    settings: dict[str, object] = {"merge.chains": len(known.truths)}
    cloud = _points_of(frame, known.mask & rows, family, seed)
    return _run(cloud, None, ("default", settings), partial(_judge, known.truths, frame.camera))


def _harness(as_cloud: bool, family: str, seed: int, size: tuple[int, int]) -> Run:
    """Return the detection of branched objects in a rendered frame with the true mask, or in its object points."""
    known, frame = _known(family, seed, size, "d435")
    assert known.mask is not None
    assert known.scene is not None
    data = _points_of(frame, known.mask, family, seed) if as_cloud else frame
    return _run(data, None if as_cloud else known.mask, ("harness", {}), partial(_judge_trees, known.scene))


def _points_of(frame: Frame, mask: Bools, family: str, seed: int) -> Cloud:
    """Return a cloud of at most CLOUD_POINTS points of a frame inside a mask (H, W) bool."""
    v, u = np.nonzero(mask & (frame.depth > 0))
    chosen = np.sort(family_rng(f"{family}/cloud", seed).permutation(len(u))[:CLOUD_POINTS])
    points = frame.camera.unproject(np.column_stack((u, v))[chosen], frame.depth[v, u][chosen].astype(float))
    return Cloud(points, viewpoint=np.zeros(3), segmented=True)


KINDS: dict[str, Callable[[str, int, tuple[int, int]], Run]] = {
    "frames": partial(_frame, "d435", "mask", False),
    "stereo": partial(_frame, "stereo", "mask", True),
    "ragged": partial(_frame, "stereo", "ragged", False),
    "untold": partial(_frame, "stereo", "auto", False),
    "images": partial(_image, True),
    "photographs": partial(_image, False),
    "clouds": partial(_cloud, False),
    "lines": partial(_cloud, True),
    "harnesses": partial(_harness, False),
    "harness clouds": partial(_harness, True),
}
"""Name of a kind of data -> function that renders a frame and returns the detection in it.

The kinds are: D435 frames with the true mask; stereo frames with the number of cables given, with a ragged mask, or with neither;
color images with a ragged mask, or with nothing given; dense clouds, and clouds of single scanner lines; branched objects in
frames, and their clouds.
"""


def _ragged(mask: Bools | None, name: str) -> Bools:
    assert mask is not None
    return ragged_mask(mask, family_rng(f"{name}/ragged", 0))


def _known(family: str, seed: int, size: tuple[int, int], sensor: str) -> tuple[KnownFrame, Frame]:
    """Render a scene, and return it as a frame with known truth, and its data."""
    scene = make_scene(family, seed, size)
    rendered = render(scene, sensor)
    return known_frame(rendered, scene), rendered.frame


def _lifted(chain: Chain, camera: Camera, depth: float) -> Chain:
    """Return a chain in px as a chain in m at the given depth (m), in the camera's optical frame."""
    scale = depth / camera.fx
    return replace(
        chain,
        joints=camera.unproject(chain.joints, np.full(len(chain.joints), depth)),
        segment_length=chain.segment_length * scale,
        radius=chain.radius * scale,
        radii=None if chain.radii is None else chain.radii * scale,
    )

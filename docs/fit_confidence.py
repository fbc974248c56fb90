"""Fit the weights of the confidence on rendered scenes: python docs/fit_confidence.py [--seeds 3] [--check 2] [--cache FOLDER]
[--photos FOLDER].

Prints the constants TOLD and UNTOLD_IMAGE of doo3d/stages/confidence/evidence.py, each by logistic regression with
weights of 0 or more; kinds of evidence that never occur have none.

TOLD: scenes of every family, by stereo with the true and with a ragged mask, and by the simulated D435 with the true mask, each
with the number of cables given and left to the data. A frame is right or wrong; the evidence is that against its least confident
chain. The weights of strays (short chains beside one five times as long) are fitted afterwards, chain by chain, to ragged masks
and to masks by color with the number left to the data, the other weights staying as they are.

UNTOLD_IMAGE: the color images of the same scenes and of those without a cable, with nothing given, by the method strands
(docs/fit_photographs.py has the network); with them every second of the labelled photographs of --photos. Every chain is right or
wrong by itself: it is right if it lies on a cable. docs/fit_untold.py fits UNTOLD.

`--check` seeds that follow are not fitted, but their likelihood is printed.
"""

from __future__ import annotations

import argparse
import pickle
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from scipy.optimize import minimize
from scipy.special import logit

from doo3d import Config, DooError, Image, load_config
from doo3d.evaluation.benchmark.cases import KnownFrame, scene_cases
from doo3d.evaluation.benchmark.evaluate import case_config
from doo3d.evaluation.metrics.score import score
from doo3d.evaluation.photos.datasets import cset, mbest
from doo3d.evaluation.rendering.ragged_mask import ragged_mask
from doo3d.evaluation.scenes.registry import FAMILIES, GROUPS, family_rng
from doo3d.pipeline import Stages, run_with_stages
from doo3d.stages.confidence import TOLD

SENSORS = ("stereo", "d435")

STRAY_KINDS = ("stubby", "stray", "odd")
"""Kinds of evidence against short chains beside a long one, where somebody said what the object is."""

TOLD_KINDS = tuple(name for name in TOLD if name not in ("base", *STRAY_KINDS))

IMAGE_KINDS = (*TOLD_KINDS, *STRAY_KINDS, "uneven")
UNTOLD_KINDS = (*IMAGE_KINDS, "flat", "edge")
"""Kinds of evidence where strands are looked for by their shape, in photographs and in frames."""

SHRINKAGE, IMAGE_SHRINKAGE = 0.05, 0.5
"""Weight of the squares of the weights, each in standard deviations of its evidence, beside the logarithm of the likelihood.
Of images there are fewer chains."""

ROUNDS = 6
"""Times that the least confident chain of each frame is chosen with the last weights."""

MIN_ON_CABLE, CABLE_MARGIN_PX = 0.9, 3
"""Share of a chain's joints on the true mask, widened by so many px, from which on a chain in an image is right."""

LEAST_ODDS = float(logit(Config().output.min_confidence))
"""Log odds below which `output.min_confidence` leaves out a chain, by default."""


@dataclass(frozen=True)
class Frame:
    """One frame: how it was segmented, its seed, whether it is right, and of each of C chains whether it is, and the evidence."""

    mode: str
    seed: int
    correct: bool
    right: list[bool]
    evidence: list[dict[str, float]]


def collect(seeds: Iterable[int], cache: Path | None) -> Iterator[Frame]:
    """Detect in the scenes of all families, sensors and modes, and yield each frame that has chains."""
    seeds = list(seeds)
    for sensor in SENSORS:
        for case in scene_cases([*FAMILIES, *GROUPS["without"]], seeds, sensor, (1280, 720)):
            known = rendered(f"{sensor}_{case.name}", case.load, cache)
            seed = int(case.name.rpartition("_")[2])
            yield from found_in(known, case.name, seed, sensor)


def rendered(name: str, load, cache: Path | None) -> KnownFrame:
    """Return a frame from the cache, or render it and keep it there."""
    file = None if cache is None else cache / f"{name}.pkl"
    if file is not None and file.exists():
        return pickle.loads(file.read_bytes())
    known = load()
    if file is not None:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(pickle.dumps(known))
    return known


def found_in(known: KnownFrame, name: str, seed: int, sensor: str) -> Iterator[Frame]:
    """Yield what is found in one frame in every mode."""
    ragged = None
    if known.truths:
        ragged = ragged_mask(known.mask, family_rng(f"{name}/ragged", 0))
        for mode, mask, given in (
            ("told", known.mask, True),
            ("told", known.mask, False),
            *((("told", ragged, True), ("told", ragged, False)) if sensor == "stereo" else ()),
        ):
            yield from detected(known, mode, seed, mask, given, "mask")
        yield from detected(known, "stray", seed, ragged, False, "mask")
        yield from detected(known, "stray", seed, None, False, "hsv")
    if sensor == "d435":
        on = np.zeros(known.data.depth.shape, dtype=bool) if known.mask is None else known.mask
        yield from detected_in_image(known.data.color, on, seed)


def detected(known: KnownFrame, mode: str, seed: int, mask, given: bool, method: str) -> Iterator[Frame]:
    """Yield what is found in one frame in one mode; nothing if there are no chains."""
    try:
        _, stages = run_with_stages(known.data, case_config(load_config("default"), known.truths, given, method), mask)
    except DooError:
        return
    result = score(stages.chains, known.truths, stages.crossings, known.data.camera)
    right = [any(score((chain,), (truth,)).correct for truth in known.truths) for chain in stages.chains]
    yield from frame_of(mode, seed, result.correct, right, stages)


def photographs(folder: Path, fitted: int, checked: int) -> Iterator[Frame]:
    """Yield what is found in labelled photographs; every second one is fitted, the others are checked."""
    for data_set, read in (("mbest", mbest), ("cset", cset)):
        for number, ref in enumerate(read(folder / data_set)):
            photo = ref.load()
            yield from detected_in_image(photo.image, photo.labels > 0, checked if number % 2 else fitted)


def detected_in_image(color: np.ndarray, on: np.ndarray, seed: int) -> Iterator[Frame]:
    """Yield what is found in a color image (H, W, 3) alone; on : (H, W) bool, the pixels of cables."""
    try:
        _, stages = run_with_stages(Image(np.ascontiguousarray(color)), load_config("image", {"segment.method": "strands"}))
    except DooError:
        return
    size = 2 * CABLE_MARGIN_PX + 1
    near = cv2.dilate(on.astype(np.uint8), np.ones((size, size), np.uint8)) > 0
    right = []
    for chain in stages.chains:
        u, v = np.rint(chain.joints.clip(0, np.array(on.shape[::-1]) - 1)).astype(int).T
        right.append(float(near[v, u].mean()) >= MIN_ON_CABLE)
    yield from frame_of("image", seed, all(right), right, stages)


def frame_of(mode: str, seed: int, correct: bool, right: list[bool], stages: Stages) -> Iterator[Frame]:
    """Yield the frame with its evidence, if it has chains."""
    if stages.chains:
        yield Frame(mode, seed, correct, right, [each.amounts() for each in stages.evidence])


def amounts(evidence: dict[str, float], kinds: Sequence[str]) -> list[float]:
    """Return the amounts of some kinds of evidence."""
    return [evidence[name] for name in kinds]


def regress(
    x: np.ndarray,
    right: np.ndarray,
    start: np.ndarray,
    offset: np.ndarray | float = 0.0,
    base: bool = True,
    shrinkage: float = SHRINKAGE,
) -> np.ndarray:
    """Return the base log odds and the weights (1 + K,) of evidence (N, K), none of the weights below 0.

    offset : log odds that stay as they are. base : whether the base is fitted; else it stays 0.
    """
    scale = x.std(axis=0)

    def loss(w: np.ndarray) -> float:
        wrong = np.logaddexp(0, np.where(right, -1, 1) * (offset + w[0] - x @ w[1:])).sum()
        return float(wrong + shrinkage * ((w[1:] * scale) ** 2).sum())

    bounds = [(None, None) if base else (0, 0), *((0, None if spread > 0 else 0) for spread in scale)]
    return np.asarray(minimize(loss, start, bounds=bounds).x)


def fit_told(frames: list[Frame]) -> np.ndarray:
    """Return base and weights of TOLD_KINDS, from the least confident chain of each frame."""
    correct = np.array([frame.correct for frame in frames])
    rows = [np.array([amounts(each, TOLD_KINDS) for each in frame.evidence]) for frame in frames]
    weights = np.concatenate(([5.0], np.ones(len(TOLD_KINDS))))
    for _ in range(ROUNDS):
        x = np.array([each[(each @ weights[1:]).argmax()] for each in rows])
        weights = regress(x, correct, weights)
    return weights


def by_chain(frames: list[Frame], kinds: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
    """Return the evidence (N, K) against all chains of all frames, and whether each is right."""
    x = np.array([amounts(each, kinds) for frame in frames for each in frame.evidence])
    return x, np.array([right for frame in frames for right in frame.right])


def print_weights(name: str, weights: Sequence[float], kinds: Sequence[str]) -> None:
    """Print one of the constants."""
    print(f"{name} = {{")
    for kind, weight in zip(("base", *kinds), weights, strict=True):
        if weight >= 0.005:
            print(f'    "{kind}": {weight:.2f},')
    print("}")


def print_likelihood(label: str, frames: list[Frame], weights: np.ndarray, kinds: Sequence[str]) -> None:
    """Print how probable the weights make what came out, chain by chain, and what `output.min_confidence` would leave out."""
    if not frames:
        return
    x, right = by_chain(frames, kinds)
    odds = weights[0] - x @ weights[1:]
    mean = float(-np.logaddexp(0, np.where(right, -odds, odds)).mean())
    low = odds < LEAST_ODDS
    lost, kept = int((low & right).sum()), int((~low & ~right).sum())
    print(f"# {label}: {len(right)} chains, {int(right.sum())} right, mean log likelihood {mean:.3f};")
    print(f"#   below output.min_confidence are {lost} right ones, above it {kept} of {int((~right).sum())} wrong ones")


def main() -> None:
    """Fit and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--start", type=int, default=0)
    parser.add_argument("--check", type=int, default=2)
    parser.add_argument("--cache", type=Path, help="folder of rendered frames, kept between calls")
    parser.add_argument("--photos", type=Path, help="folder that holds mbest/ and cset/")
    parser.add_argument("--keep-told", action="store_true", help="take the weights of TOLD as they are, and fit the rest")
    options = parser.parse_args()
    middle = options.start + options.seeds
    frames = list(collect(range(options.start, middle + options.check), options.cache))
    if options.photos:
        frames += photographs(options.photos, options.start, middle)

    def part(mode: str, fitted: bool = True) -> list[Frame]:
        return [frame for frame in frames if frame.mode == mode and (frame.seed < middle) == fitted]

    told = np.array([TOLD["base"], *(TOLD[name] for name in TOLD_KINDS)]) if options.keep_told else fit_told(part("told"))
    x, right = by_chain(part("stray"), TOLD_KINDS)
    strays = regress(
        by_chain(part("stray"), STRAY_KINDS)[0], right, np.zeros(len(STRAY_KINDS) + 1), told[0] - x @ told[1:], base=False
    )
    both = (*TOLD_KINDS, *STRAY_KINDS)
    print_weights("TOLD", [*told, *strays[1:]], both)
    for label in (True, False):
        print_likelihood("fitted" if label else "checked", part("stray", label), np.array([*told, *strays[1:]]), both)
    x, right = by_chain(part("image"), IMAGE_KINDS)
    weights = regress(x, right, np.concatenate(([5.0], np.ones(len(IMAGE_KINDS)))), shrinkage=IMAGE_SHRINKAGE)
    print_weights("UNTOLD_IMAGE", weights, IMAGE_KINDS)
    for label in (True, False):
        print_likelihood("fitted" if label else "checked", part("image", label), weights, IMAGE_KINDS)


if __name__ == "__main__":
    main()

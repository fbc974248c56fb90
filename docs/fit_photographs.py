"""Fit what makes a chain in a photograph a cable, for the network: python docs/fit_photographs.py [--data DIR] [--cache DIR].

Prints UNTOLD_NETWORK of doo3d/stages/confidence/evidence.py, by logistic regression with weights of 0 or more. The images: the
color of rendered scenes without a cable, seeds 10 to 17, and of all families and tough ones, seeds 10 to 12 (seeds 0 to 3 are
those of docs/measure_without_cable.py); and every second photograph of DIR/mbest and DIR/cset. A chain is right if half of its
joints lie on a cable. Scenes without a cable count together WITHOUT_TIMES as much as all other images. Printed beside is what
`output.min_confidence` leaves out.
"""

from __future__ import annotations

import argparse
import pickle
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from fit_confidence import CABLE_MARGIN_PX, IMAGE_SHRINKAGE, LEAST_ODDS
from scipy.optimize import minimize

from doo3d import DooError, Image, load_config
from doo3d.evaluation.photos.datasets import cset, mbest
from doo3d.evaluation.rendering.renderer import render
from doo3d.evaluation.scenes.registry import GROUPS, make_scene
from doo3d.pipeline import run_with_stages
from doo3d.stages.confidence import looks

KINDS = ("bend", "unclaimed", "stubby", "uneven", "edge", "odd", "doubted", "rod")
"""Kinds of evidence that a photograph has; `unsure` is added."""

WITHOUT_SEEDS, WITH_SEEDS, SENSORS = range(10, 18), range(10, 13), ("d435", "stereo")

WITHOUT_TIMES = 3.0
"""How much the scenes without a cable count together, times all other images: of 1, 2, 3 and 4 chosen on the frames of
docs/measure_without_cable.py and the photographs."""

MIN_ON_CABLE = 0.5
"""Share of a chain's joints on the true mask, widened by CABLE_MARGIN_PX, from which on a chain is a cable."""


@dataclass(frozen=True)
class Chains:
    """The chains of an image: its group, the evidence (C, K) against them, and whether each is right, (C,)."""

    group: str
    evidence: np.ndarray
    right: np.ndarray


def images(data: Path | None, cache: Path | None) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
    """Yield the group, the color image (H, W, 3) and the pixels of cables (H, W) bool of each image."""
    for group, seeds in (("without", WITHOUT_SEEDS), ("all", WITH_SEEDS), ("tough", WITH_SEEDS)):
        for seed in seeds:
            for family in GROUPS[group]:
                yield group, *rendered(family, seed, cache)
    for name, read in (("mbest", mbest), ("cset", cset)) if data else ():
        for ref in read(data / name)[::2]:
            photo = ref.load()
            yield name, photo.image, photo.labels > 0


def rendered(family: str, seed: int, cache: Path | None) -> tuple[np.ndarray, np.ndarray]:
    """Return the color of a scene and the pixels of its cables, from the cache or rendered and kept there."""
    file = None if cache is None else cache / f"{family}_{seed:03d}.pkl"
    if file is not None and file.exists():
        return pickle.loads(file.read_bytes())
    made = render(make_scene(family, seed), SENSORS[seed % 2])
    pair = made.frame.color, made.mask
    if file is not None:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(pickle.dumps(pair))
    return pair


def found_in(group: str, color: np.ndarray, on: np.ndarray) -> Chains | None:
    """Detect in an image with nothing given; None if there are no chains."""
    try:
        _, stages = run_with_stages(Image(np.ascontiguousarray(color)), load_config("image"))
    except DooError:
        return None
    if not stages.chains:
        return None
    size = 2 * CABLE_MARGIN_PX + 1
    near = cv2.dilate(on.astype(np.uint8), np.ones((size, size), np.uint8)) > 0
    share = []
    for chain in stages.chains:
        u, v = np.rint(chain.joints.clip(0, np.array(on.shape[::-1]) - 1)).astype(int).T
        share.append(near[v, u].mean())
    evidence = np.array([[each.amounts()[kind] for kind in KINDS] for each in stages.evidence])
    return Chains(group, evidence, np.array(share) >= MIN_ON_CABLE)


def fit(found: list[Chains]) -> tuple[np.ndarray, np.ndarray]:
    """Return base and weights, `unsure` last, none of the weights below 0, and the log odds of all chains."""
    x, right = np.concatenate([each.evidence for each in found]), np.concatenate([each.right for each in found])
    image = np.repeat(np.arange(len(found)), [len(each.right) for each in found])
    without = np.array([each.group == "without" for each in found])
    counts = np.where(without, WITHOUT_TIMES * (~without).sum() / without.sum(), 1.0)[image]

    def amounts(weights: np.ndarray) -> np.ndarray:
        """Return the evidence (N, K + 1): the surest chain of an image follows from the weights."""
        losses = x @ weights[1:-1]
        least = np.full(len(found), np.inf)
        np.minimum.at(least, image, losses)
        return np.column_stack((x, least[image]))

    def loss(weights: np.ndarray) -> float:
        every = amounts(weights)
        wrong = np.logaddexp(0, np.where(right, -1, 1) * (weights[0] - every @ weights[1:]))
        return float((counts * wrong).sum() + IMAGE_SHRINKAGE * ((weights[1:] * every.std(axis=0)) ** 2).sum())

    start = np.concatenate(([5.0], np.ones(x.shape[1]), [0.5]))
    bounds = [(None, None), *[(0, None)] * (x.shape[1] + 1)]
    weights = minimize(loss, start, method="L-BFGS-B", bounds=bounds, options={"maxiter": 3000, "maxfun": 60000}).x
    return weights, weights[0] - amounts(weights) @ weights[1:]


def main() -> None:
    """Fit and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, help="folder that holds mbest/ and cset/")
    parser.add_argument("--cache", type=Path, help="folder of rendered images, kept between calls")
    options = parser.parse_args()
    looks.DOUBTFUL_ODDS = -looks.CLEAR_ODDS  # the fit sees all doubts, without their limit
    made = [found_in(*each) for each in images(options.data, options.cache)]
    found = [each for each in made if each is not None]
    weights, odds = fit(found)
    print("UNTOLD_NETWORK = {")
    for kind, weight in zip(("base", *KINDS, "unsure"), weights, strict=True):
        if weight >= 0.005:
            print(f'    "{kind}": {weight:.2f},')
    print("}")
    right = np.concatenate([each.right for each in found])
    bounds = np.cumsum([0, *(len(each.right) for each in found)])
    low = odds < LEAST_ODDS
    for group in dict.fromkeys(each.group for each in found):
        of = np.concatenate([np.full(len(each.right), each.group == group) for each in found])
        shown = sum(not low[a:b].all() for a, b, each in zip(bounds[:-1], bounds[1:], found, strict=True) if each.group == group)
        print(f"# {group}: images with chains {shown}; right chains {(of & right).sum()}, left out {(of & right & low).sum()};")
        print(f"#   wrong chains {(of & ~right).sum()}, left out {(of & ~right & low).sum()}")


if __name__ == "__main__":
    main()
